"""Files from outside, read once, with limits, and checked before anything else sees them; and how ours are written."""
