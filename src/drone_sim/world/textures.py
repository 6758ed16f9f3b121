"""The textures that PyBullet is given: only its window and its own renderer show them."""

from __future__ import annotations

import pybullet

from drone_sim.world.own_files import OwnFiles


class Textures:
    """Which image covers which body; PyBullet gets them when somebody looks."""

    def __init__(self, client: int, files: OwnFiles):
        """Begin with none."""
        self._client = client
        self._files = files
        self._waiting: dict[int, tuple[str, int]] = {}

    def cover(self, body: int, texture: str, visual: int = -1) -> None:
        """Cover a visual shape of a body (-1: all of its root link's) with an image, '' for none."""
        if texture:
            self._waiting[body] = (texture, visual)

    def show(self) -> None:
        """Give PyBullet those that it has not got yet."""
        while self._waiting:
            body, (texture, visual) = self._waiting.popitem()
            image = pybullet.loadTexture(self._files.texture(texture), physicsClientId=self._client)
            pybullet.changeVisualShape(body, -1, visual, textureUniqueId=image, physicsClientId=self._client)

    def forget(self, body: int) -> None:
        """Forget a body that is gone."""
        self._waiting.pop(body, None)
