"""Formulas for frames, states, wrenches and rigid bodies, in SI units, without PyBullet or ROS."""
