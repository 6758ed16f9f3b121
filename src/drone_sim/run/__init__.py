"""What runs: the simulation, its player, its pace, its parameters."""
