"""A few odd inputs of every kind, always the same; `./dev.sh fuzz` tries as many as you like."""

import pytest
from pool import Trier
from run import KINDS, keep, run_kind

CASES = 6  # of each kind
MORE = {"archives": 30}  # none of which needs a simulation
SEED = 8


@pytest.fixture(name="trier", scope="session")
def _trier():
    trier = Trier()
    yield trier
    trier.close()


@pytest.mark.parametrize("kind", KINDS)
def test_odd_input_is_taken_or_refused_in_one_line(kind, trier, tmp_path):
    result = run_kind(kind, MORE.get(kind, CASES), SEED, trier)
    assert not result.found, "\n".join(keep(result, tmp_path, SEED))
    assert result.taken + result.refused >= CASES // 2
