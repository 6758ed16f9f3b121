"""One renderer for all tests that draw: compiling its shaders takes longer than most of them."""

import pytest

from drone_sim.camera.renderer import Renderer


@pytest.fixture(name="shared_renderer", scope="session")
def _shared_renderer():
    renderer = Renderer()
    yield renderer
    renderer.close()


@pytest.fixture(name="renderer")
def _renderer(shared_renderer):
    shared_renderer.set_visuals(())
    return shared_renderer
