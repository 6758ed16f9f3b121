"""What a value in a YAML file may be, and the one-line message for a wrong one."""
