"""From recordings to parameters: noise, likelihood, search, posterior."""
