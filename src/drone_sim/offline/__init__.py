"""Flying without ROS: a timeline of commands in; a CSV, a plot and a summary out."""
