"""The simulation, its player, its real-time pace and its parameters."""
