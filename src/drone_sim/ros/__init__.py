"""ROS around the simulation: the only package that imports rospy."""
