"""CoppeliaSim's ZeroMQ remote API: external programs call the functions that child scripts call."""
