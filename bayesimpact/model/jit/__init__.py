"""How and on how many threads the package compiles, and how much it simulates."""
