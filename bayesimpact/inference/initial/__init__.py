"""Start values of the identification."""
