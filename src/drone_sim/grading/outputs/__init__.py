"""Output formats of results for terminals, browsers, CI systems and programs."""
