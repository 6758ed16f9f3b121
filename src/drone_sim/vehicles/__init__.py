"""Vehicles: body, propulsion, sensors, faults, commands and scene objects under V-REP's names."""
