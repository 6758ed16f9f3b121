"""Programs of the docs: the notebook, the flight over the remote API, and the environments for Gymnasium."""

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


def test_the_first_flight_notebook_climbs_and_shows_plots_and_a_picture(monkeypatch):
    monkeypatch.setenv("PYTHONPATH", python_path())
    notebook = nbformat.read(DOCS / "notebooks/first_flight.ipynb", as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells), "outputs would be out of date"
    notebook.cells.append(nbformat.v4.new_code_cell("print(*places[-1])"))
    NotebookClient(notebook, timeout=100, resources={"metadata": {"path": str(DOCS / "notebooks")}}).execute()
    *outputs, last = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    assert [item["output_type"] for item in outputs if "image/png" in item.get("data", {})] == ["display_data"] * 2
    assert any(item.get("data", {}).get("text/plain") == "(480, 640, 3)" for item in outputs)
    x, _, z = map(float, last["text"].split())
    assert abs(z - 1.5) < 0.1 and x > 1.5


def test_the_drone_follows_a_sphere_moved_over_the_remote_api(tmp_path, monkeypatch):
    pytest.importorskip("coppeliasim_zmqremoteapi_client")
    matplotlib.use("Agg")
    monkeypatch.syspath_prepend(str(DOCS / "remote"))
    from without_ros import main

    picture = tmp_path / "circle.png"
    targets, positions = main(["--seconds", "6", "--plot", str(picture)])
    assert len(targets) == len(positions) == 120
    assert max(math.dist(*pair) for pair in zip(targets, positions)) < 0.5
    assert positions[-1][0] > 0.9 and positions[-1][2] > 1.4
    assert picture.stat().st_size > 10_000
    sys.modules.pop("fly_outside")
    sys.modules.pop("without_ros")


@pytest.fixture(name="environment")
def _environment(monkeypatch):
    pytest.importorskip("gymnasium", reason="needs gymnasium, of requirements-dev.txt")
    monkeypatch.syspath_prepend(DOCS / "lockstep")
    monkeypatch.delitem(sys.modules, "gym_env", raising=False)
    from gym_env import FlyTo

    gym_environment = FlyTo()
    yield gym_environment
    gym_environment.close()


@pytest.mark.filterwarnings("ignore:.*check_env.*")
def test_the_environment_passes_the_check_of_gymnasium(environment):
    from gymnasium.utils.env_checker import check_env

    check_env(environment, skip_render_check=True)


def test_the_environment_reaches_its_goal_and_repeats_the_flight_of_a_seed(environment):
    trajectories = []
    for _ in range(2):
        observation, _ = environment.reset(seed=7)
        trajectory, is_over = [observation], False
        while not is_over:
            observation, reward, terminated, truncated, _ = environment.step(np.clip(0.4 * observation[:3], -0.5, 0.5))
            trajectory.append(observation)
            is_over = terminated or truncated
        assert terminated and reward > -0.1
        trajectories.append(np.array(trajectory))
    assert (trajectories[0] == trajectories[1]).all()


@pytest.mark.parametrize("file", ["gym_env.py", "gym_ros_env.py"])
def test_fly_md_contains_the_current_program(file):
    blocks = re.findall(r"```python\n(.*?)```", (DOCS / "fly.md").read_text(encoding="utf-8"), re.DOTALL)
    assert (DOCS / "lockstep" / file).read_text(encoding="utf-8") in blocks
