"""What a free decay shows by itself: backbone and damping from zero crossings."""
