"""What the page's editor asks for: scripts, the texts beside them, the scenes they fly in, and grading."""
