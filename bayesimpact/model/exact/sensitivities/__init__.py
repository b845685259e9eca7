"""Exact derivatives of its recordings, through the impacts."""
