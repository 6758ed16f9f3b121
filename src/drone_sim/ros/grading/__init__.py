"""Grading on a running simulator, so that a ROS node can fly."""
