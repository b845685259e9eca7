"""Opened trials: was the answer right, and how often."""
