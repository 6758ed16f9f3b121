"""What measures: each sensor with its period, its pose, its noise and its last sample."""
