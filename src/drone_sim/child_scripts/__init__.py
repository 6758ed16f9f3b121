"""The built-in child scripts. They are not imported, but loaded like a student's scripts."""
