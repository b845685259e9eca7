"""Where the model misses, what physics was left out, and whether adding it helps.

`diagnose` is the whole way: faults of recordings, then `loop` on what is left of the campaign.
"""
