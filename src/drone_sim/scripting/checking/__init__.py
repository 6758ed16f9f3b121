"""What is wrong with a script's text, told without running any of it."""
