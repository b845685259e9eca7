"""Results as files, figures and one page."""
