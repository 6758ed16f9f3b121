"""The scene editor: edit requests as records, undo and redo, files; used by the simulation's windows and scripts."""
