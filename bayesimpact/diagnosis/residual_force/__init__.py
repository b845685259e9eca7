"""The missing force as a function of state or time, whatever it is."""
