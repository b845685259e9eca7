"""Posterior by ensembles of walkers, saved in blocks."""
