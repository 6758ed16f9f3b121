"""The simulator node: parameters, start, steps, services, end."""
