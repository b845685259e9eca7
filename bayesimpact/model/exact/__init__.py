"""The base oscillator in closed form, from event to event."""
