"""The independent rig: recordings with any effects planted in them, by SciPy alone."""
