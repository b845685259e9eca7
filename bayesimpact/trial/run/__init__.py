"""Many trials: truths sealed first, campaigns diagnosed, seals opened."""
