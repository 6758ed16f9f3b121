"""The scene around the vehicles: scene files, their bodies and objects, and operations on these."""
