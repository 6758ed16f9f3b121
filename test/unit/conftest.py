"""Fixtures that several test files share, and settings for all tests."""

import contextlib
import gc
import signal
from importlib.util import find_spec

import pytest
from hypothesis import HealthCheck, settings

from drone_sim.render.renderer import Renderer
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation

# The same examples in every run, without a deadline, since some machines are slow.
settings.register_profile("same", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("same")

# A background job of a shell ignores SIGINT, and a job under nohup ignores SIGHUP. Child processes would inherit that,
# and tests could not interrupt them.
signal.signal(signal.SIGINT, signal.default_int_handler)
if signal.getsignal(signal.SIGHUP) == signal.SIG_IGN:
    signal.signal(signal.SIGHUP, lambda *_: None)  # programs inherit SIG_IGN, but no handler


@pytest.fixture(name="shared_renderer", scope="session")
def _shared_renderer():
    """Yield one renderer for all tests that draw, since compiling its shaders takes longer than most of the tests."""
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
    """Yield a function that builds a simulation from parameters and advances it; close all simulations at the end.

    The drone's script may be given as a text, `lua` or `python`, and the scene file as the text `scene`.
    """
    with contextlib.ExitStack() as exit_stack:

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
            exit_stack.callback(simulation.close)
            for _ in range(steps):
                simulation.step()
            return simulation

        yield build


@pytest.fixture
def new_simulation(tmp_path):
    yield from simulations(tmp_path)


@pytest.fixture(scope="module")
def new_shared_simulation(tmp_path_factory):
    """Do the same as new_simulation, for a simulation that all tests of a file share."""
    yield from simulations(tmp_path_factory.mktemp("shared"))


def pytest_collection_modifyitems(items):
    if find_spec("rospkg") is None:
        for item in items:
            if item.get_closest_marker("ros"):
                item.add_marker(pytest.mark.skip(reason="needs ROS"))


def pytest_collection_finish():
    gc.collect()
    gc.freeze()  # garbage collections, here and in forks, need not scan all tests again


def pytest_sessionfinish():
    gc.unfreeze()  # otherwise nanobind would report the frozen objects as leaks at exit


def pytest_terminal_summary(terminalreporter, config):
    seed = getattr(config.option, "randomly_seed", None)
    if isinstance(seed, int):
        terminalreporter.write_line(f"the order of these tests comes back with -p randomly --randomly-seed={seed}")


def pytest_make_parametrize_id(val):
    """Return the length as the id of a long value, since pytest would put the whole value into the test's name."""
    return f"{len(val)} long" if isinstance(val, (str, bytes)) and len(val) > 200 else None
