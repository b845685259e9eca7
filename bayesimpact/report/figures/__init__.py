"""Figures of the report: the only place, beside the plot of `check`, that uses matplotlib."""
