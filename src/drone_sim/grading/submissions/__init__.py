"""What a class has handed in: scripts, folders, zips as Moodle and Gradescope export them, a table."""
