"""Readers of instrument files: one format, one file; each gives channels."""
