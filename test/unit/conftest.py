"""Fixtures of several test files, and the options of all."""

import contextlib
import gc
import signal
from importlib.util import find_spec

import pytest
from hypothesis import HealthCheck, settings

from drone_sim.render.renderer import Renderer
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation

# The same examples every time, however slow the machine.
settings.register_profile("same", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("same")

# A shell's background job ignores Ctrl-C, what nohup starts ignores SIGHUP, and so would every process that a test
# starts to interrupt it.
signal.signal(signal.SIGINT, signal.default_int_handler)
if signal.getsignal(signal.SIGHUP) == signal.SIG_IGN:
    signal.signal(signal.SIGHUP, lambda *_: None)  # which no other program inherits


@pytest.fixture(name="shared_renderer", scope="session")
def _shared_renderer():
    """Return one renderer for all tests that draw: compiling its shaders takes longer than most of them."""
    renderer = Renderer()
    yield renderer
    renderer.close()


@pytest.fixture(name="renderer")
def _renderer(shared_renderer):
    shared_renderer.set_visuals(())
    return shared_renderer


class Clock:
    now = 0.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    """Return a clock whose `now` the test sets."""
    return Clock()


def simulations(folder):
    """Yield a function that builds a simulation from parameters, and advances it by some steps; close all in the end.

    The drone's script may be given as text, `lua` or `python`, and so may the scene's file.
    """
    with contextlib.ExitStack() as in_the_end:

        def build(values=None, steps=0, *, lua=None, python=None, scene=None, **options):
            values = dict(values or {})
            for name, text in (("script.lua", lua), ("script.py", python), ("scene.yaml", scene)):
                if text is not None:
                    (folder / name).write_text(text, encoding="utf-8")
            if scene is not None:
                values["scene_file"] = str(folder / "scene.yaml")
            if lua is not None or python is not None:
                options["script"] = str(folder / ("script.py" if lua is None else "script.lua"))
            simulation = Simulation(parameters.load(values), **options)
            in_the_end.callback(simulation.close)
            for _ in range(steps):
                simulation.step()
            return simulation

        yield build


@pytest.fixture
def new_simulation(tmp_path):
    yield from simulations(tmp_path)


@pytest.fixture(scope="module")
def new_shared_simulation(tmp_path_factory):
    """Do what new_simulation does, for a simulation that the tests of a file share."""
    yield from simulations(tmp_path_factory.mktemp("shared"))


def pytest_collection_modifyitems(items):
    if find_spec("rospkg") is None:
        for item in items:
            if item.get_closest_marker("ros"):
                item.add_marker(pytest.mark.skip(reason="needs ROS"))


def pytest_collection_finish():
    gc.collect()
    gc.freeze()  # so that no collection, here or in a fork, looks through all the tests again


def pytest_sessionfinish():
    gc.unfreeze()  # for nanobind, which tells of what is left at the end


def pytest_terminal_summary(terminalreporter, config):
    seed = getattr(config.option, "randomly_seed", None)
    if isinstance(seed, int):
        terminalreporter.write_line(f"the order of these tests comes back with -p randomly --randomly-seed={seed}")


def pytest_make_parametrize_id(val):
    """Name a long value by its length: pytest would make it a part of the test's name, over and over."""
    return f"{len(val)} long" if isinstance(val, (str, bytes)) and len(val) > 200 else None
