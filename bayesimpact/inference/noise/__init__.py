"""Noise: how it whitens residuals, and its estimates from recordings and fits."""
