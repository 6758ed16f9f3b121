"""Runs scripts: those that fly vehicles, and those on other objects; in which order, with which parameters."""
