"""Faults of a recording, found by comparison with the other recordings of its campaign."""
