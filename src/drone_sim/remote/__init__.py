"""CoppeliaSim's ZeroMQ remote API: programs outside call the functions that child scripts call."""
