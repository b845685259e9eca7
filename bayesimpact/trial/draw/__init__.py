"""From a seed to a campaign and the truth about it."""
