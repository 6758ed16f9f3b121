"""Fixtures of several test files, and the options of all."""

import contextlib
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


@pytest.fixture
def new_simulation(tmp_path):
    """Return a function that builds a simulation from parameters, and advances it by some steps.

    The drone's script may be given as text, `lua` or `python`. The simulations are closed after the test.
    """
    with contextlib.ExitStack() as after_the_test:

        def build(values=None, steps=0, lua=None, python=None, **options):
            for ending, text in (("lua", lua), ("py", python)):
                if text is not None:
                    (tmp_path / f"script.{ending}").write_text(text, encoding="utf-8")
                    options["script"] = str(tmp_path / f"script.{ending}")
            simulation = Simulation(parameters.load(values), **options)
            after_the_test.callback(simulation.close)
            for _ in range(steps):
                simulation.step()
            return simulation

        yield build


def pytest_collection_modifyitems(items):
    if find_spec("rospkg") is None:
        for item in items:
            if item.get_closest_marker("ros"):
                item.add_marker(pytest.mark.skip(reason="needs ROS"))


def pytest_terminal_summary(terminalreporter, config):
    seed = getattr(config.option, "randomly_seed", None)
    if isinstance(seed, int):
        terminalreporter.write_line(f"the order of these tests comes back with -p randomly --randomly-seed={seed}")


def pytest_make_parametrize_id(val):
    """Name a long value by its length: pytest would make it a part of the test's name, over and over."""
    return f"{len(val)} long" if isinstance(val, (str, bytes)) and len(val) > 200 else None
