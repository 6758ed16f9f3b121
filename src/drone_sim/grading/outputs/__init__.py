"""Results in the forms that a terminal, a browser, a CI system or a program reads: one file here for each."""
