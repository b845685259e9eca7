"""What the measuring chain does: hums, filters, noise, and what looks alike."""
