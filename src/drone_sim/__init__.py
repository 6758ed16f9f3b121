"""The drone of a V-REP tutorial, without V-REP: PyBullet underneath, ROS around it."""
