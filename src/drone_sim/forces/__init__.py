"""What pushes: propellers, pushes."""
