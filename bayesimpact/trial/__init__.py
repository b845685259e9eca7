"""Blind trials: an independent rig, sealed truths, scored diagnoses."""
