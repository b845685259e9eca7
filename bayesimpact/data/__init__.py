"""Recordings and campaigns: what was measured, read and checked."""
