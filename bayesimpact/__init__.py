"""Bayesian identification of impacting systems, and a diagnosis of what a model leaves out."""
