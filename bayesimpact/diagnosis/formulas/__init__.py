"""From a learned force to a formula."""
