"""Where the model misses, what physics was left out, and whether adding it helps."""
