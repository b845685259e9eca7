"""What small forces along a known motion change, without simulating them."""
