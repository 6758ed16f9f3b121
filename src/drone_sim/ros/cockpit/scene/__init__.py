"""The scene in the browser: frames, markers, meshes, and handles to drag."""
