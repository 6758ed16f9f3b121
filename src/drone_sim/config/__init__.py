"""Types of the values in YAML files, and one-line messages for invalid values."""
