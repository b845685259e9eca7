"""Faults of a recording, found in the recording itself before any physics: one fault, one file."""
