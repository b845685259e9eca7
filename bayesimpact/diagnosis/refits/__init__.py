"""A fit with more effects in it: its start, its evidence, its sizes."""
