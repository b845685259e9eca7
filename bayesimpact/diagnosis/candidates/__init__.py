"""Which sets of effects and terms are tried: those that recordings ask for."""
