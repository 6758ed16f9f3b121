"""Frames, states, wrenches, rigid bodies: formulas, in SI units, without PyBullet or ROS."""
