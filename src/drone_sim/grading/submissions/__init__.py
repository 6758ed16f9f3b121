"""The submissions of a class: scripts, folders, zips as Moodle and Gradescope export them, and tables."""
