"""The next recording: what would tell the rivals of a diagnosis apart, and what would narrow k2."""
