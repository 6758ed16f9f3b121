"""The node's life: parameters, start, steps, services, end."""
