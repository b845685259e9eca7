"""The oscillator with added effects, integrated from event to event."""
