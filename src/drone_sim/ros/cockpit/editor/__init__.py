"""Backend of the page's editor: scripts, lessons, scenes and grading."""
