"""The search through the models, and the verdict that follows from it."""
