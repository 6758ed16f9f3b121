"""Edits of the scene as records, with undo and redo: what the windows of the simulation are made of."""
