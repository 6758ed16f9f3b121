"""The topics of a vehicle."""
