"""A plan graded on a running simulator, so that what flies may be a ROS node."""
