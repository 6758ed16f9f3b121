"""Programs of docs: the notebook, the flight by the remote API, and the environments for Gymnasium do what docs say."""

import math
import re
import sys

import matplotlib
import nbformat
import numpy as np
import pytest
from nbclient import NotebookClient

from drone_sim.files.resources import package_path, python_path

DOCS = package_path() / "docs"


def test_the_first_flight_climbs_is_plotted_and_seen(monkeypatch):
    monkeypatch.setenv("PYTHONPATH", python_path())
    notebook = nbformat.read(DOCS / "notebooks/first_flight.ipynb", as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells), "outputs would be out of date"
    notebook.cells.append(nbformat.v4.new_code_cell("print(*places[-1])"))
    NotebookClient(notebook, timeout=100, resources={"metadata": {"path": str(DOCS / "notebooks")}}).execute()
    *outputs, last = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    assert [one["output_type"] for one in outputs if "image/png" in one.get("data", {})] == ["display_data"] * 2
    assert any(one.get("data", {}).get("text/plain") == "(480, 640, 3)" for one in outputs)
    x, _, z = map(float, last["text"].split())
    assert abs(z - 1.5) < 0.1 and x > 1.5


def test_the_drone_follows_the_sphere_that_is_led_from_outside(tmp_path, monkeypatch):
    pytest.importorskip("coppeliasim_zmqremoteapi_client")
    matplotlib.use("Agg")
    monkeypatch.syspath_prepend(str(DOCS / "remote"))
    from without_ros import main

    picture = tmp_path / "circle.png"
    led, flown = main(["--seconds", "6", "--plot", str(picture)])
    assert len(led) == len(flown) == 120
    assert max(math.dist(*pair) for pair in zip(led, flown)) < 0.5
    assert flown[-1][0] > 0.9 and flown[-1][2] > 1.4
    assert picture.stat().st_size > 10_000
    sys.modules.pop("fly_outside")
    sys.modules.pop("without_ros")


@pytest.fixture(name="environment")
def _environment(monkeypatch):
    pytest.importorskip("gymnasium", reason="needs gymnasium, of requirements-dev.txt")
    monkeypatch.syspath_prepend(DOCS / "lockstep")
    monkeypatch.delitem(sys.modules, "gym_env", raising=False)
    from gym_env import FlyTo

    made = FlyTo()
    yield made
    made.close()


@pytest.mark.filterwarnings("ignore:.*check_env.*")
def test_the_environment_passes_the_check_of_gymnasium(environment):
    from gymnasium.utils.env_checker import check_env

    check_env(environment, skip_render_check=True)


def test_the_environment_flies_to_its_goal_and_the_same_way_again(environment):
    ways = []
    for _ in range(2):
        observation, _ = environment.reset(seed=7)
        way, ends = [observation], False
        while not ends:
            observation, reward, is_there, is_late, _ = environment.step(np.clip(0.4 * observation[:3], -0.5, 0.5))
            way.append(observation)
            ends = is_there or is_late
        assert is_there and reward > -0.1
        ways.append(np.array(way))
    assert (ways[0] == ways[1]).all()


@pytest.mark.parametrize("file", ["gym_env.py", "gym_ros_env.py"])
def test_the_page_shows_the_file(file):
    blocks = re.findall(r"```python\n(.*?)```", (DOCS / "fly.md").read_text(encoding="utf-8"), re.DOTALL)
    assert (DOCS / "lockstep" / file).read_text(encoding="utf-8") in blocks
