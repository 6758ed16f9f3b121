"""The environments of docs/fly.md: Gymnasium's own check, and the page shows the files."""

import re
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("gymnasium", reason="needs gymnasium, of requirements-dev.txt")

from gymnasium.utils.env_checker import check_env

DOCS = Path(__file__).resolve().parents[2] / "docs"


@pytest.fixture(name="environment")
def _environment(monkeypatch):
    monkeypatch.syspath_prepend(DOCS / "lockstep")
    monkeypatch.delitem(sys.modules, "gym_env", raising=False)
    from gym_env import FlyTo

    made = FlyTo()
    yield made
    made.close()


@pytest.mark.filterwarnings("ignore:.*check_env.*")
def test_it_passes_the_check_of_gymnasium(environment):
    check_env(environment, skip_render_check=True)


def test_it_flies_to_its_goal_and_the_same_way_again(environment):
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
