"""Formulas for a force that the catalogue does not list: grammar, library, odds, and their file."""
