"""A report to open in a browser, from file:// and without a network: what was flown, and what came of it."""
