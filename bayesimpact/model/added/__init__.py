"""Parts of the simulator for oscillators with added effects; `general` is its door."""
