"""The scene: what stands in it, what can be dragged, and where one looks from."""
