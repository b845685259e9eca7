"""The oscillator: closed-form motion, events, added effects and the measuring chain."""
