"""Shared by all nodes: start and end of a node, conversion and checks of messages, stamps, the simulator's services."""
