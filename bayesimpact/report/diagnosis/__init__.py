"""A diagnosis as a document, in words, and as arrays and rows of the report."""
