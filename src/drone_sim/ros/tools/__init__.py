"""Nodes of their own beside the simulation: the keyboard, the window."""
