"""Strategies of the fuzz tests: a module for each kind of input, with its strategy `CASES`."""
