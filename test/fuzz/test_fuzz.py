"""A few odd inputs of every kind, always the same; `./dev.sh fuzz` tries any number of them."""

import importlib
import os

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import seed as seeded
from pool import Trier

KINDS = (
    *("messages", "requests", "connections", "legacy_commands", "bags", "archives", "browsers"),
    *("parameters", "scenes", "meshes", "urdfs", "timelines", "lua_scripts", "python_scripts"),
)
CASES = 6  # of each kind
MORE = {"archives": 30}  # these cases need no simulation
COUNT = int(os.environ.get("DRONE_SIM_FUZZ_CASES", "0"))  # cases of each kind, set by ./dev.sh fuzz
SEED = int(os.environ.get("DRONE_SIM_FUZZ_SEED", "8"))
OPTIONS = settings(deadline=None, derandomize=False, suppress_health_check=list(HealthCheck))


@pytest.fixture(name="trier", scope="session")
def _trier():
    trier = Trier()
    yield trier
    trier.close()


@pytest.mark.filterwarnings("ignore::hypothesis.errors.HypothesisWarning")  # some cases are large
@pytest.mark.parametrize("kind", KINDS)
def test_odd_input_is_taken_or_refused_in_one_line(kind, trier):
    outcomes = []

    @seeded(SEED)
    @settings(
        OPTIONS, max_examples=COUNT or MORE.get(kind, CASES), database=settings.default.database if COUNT else None
    )
    @given(importlib.import_module(f"kinds.{kind}").CASES)
    def trial(case):
        answer = trier.run(case)
        assert not answer.fault, answer.fault
        outcomes.append("refused" if answer.refusal else "taken")

    trial()
    print(f"{kind}: {outcomes.count('taken')} taken, {outcomes.count('refused')} refused")
    assert len(outcomes) >= CASES // 2
