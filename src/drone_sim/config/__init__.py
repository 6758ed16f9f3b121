"""What a value in a YAML file may be, and the one line that a wrong one gets."""
