"""Flights without ROS: a timeline of commands as input; a CSV file, a plot, a video and a dataset as output."""
