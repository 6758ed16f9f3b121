"""What stands in the world besides the vehicles: from a scene file into the world, and back."""
