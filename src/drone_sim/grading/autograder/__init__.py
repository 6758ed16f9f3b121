"""The autograder for Gradescope: a zip with this package, a plan, and the scripts that run them."""
