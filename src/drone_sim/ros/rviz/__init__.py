"""Markers and handles for rviz, drawn only for subscribers."""
