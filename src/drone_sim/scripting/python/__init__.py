"""Child scripts in Python."""
