"""What is tried: a module per kind of input, each with a strategy `CASES`."""
