"""Diagnosis of why a vehicle does not fly as expected: state of vehicles, pace, scripts and cameras."""
