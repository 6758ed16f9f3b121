"""The panel beside the scene, and the pictures and windows over it."""
