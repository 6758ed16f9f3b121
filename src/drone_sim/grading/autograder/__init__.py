"""A zip that Gradescope takes as an autograder: this package, a plan, and what runs them there."""
