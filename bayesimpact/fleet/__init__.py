"""Many campaigns as one: each identified or diagnosed, then compared with one another."""
