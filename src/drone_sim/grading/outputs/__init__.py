"""Results for who reads them: a terminal, a browser, a CI system, a program. Each file is one of these."""
