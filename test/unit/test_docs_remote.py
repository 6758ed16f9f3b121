"""docs/remote_api.md: its flight is flown as its scripts say."""

import math
import sys

import matplotlib
import pytest

from drone_sim.files.resources import package_path

DOCS = package_path() / "docs" / "remote"


def test_the_drone_follows_the_sphere_that_is_led_from_outside(tmp_path, monkeypatch):
    pytest.importorskip("coppeliasim_zmqremoteapi_client")
    matplotlib.use("Agg")
    monkeypatch.syspath_prepend(str(DOCS))
    from without_ros import main

    picture = tmp_path / "circle.png"
    led, flown = main(["--seconds", "6", "--plot", str(picture)])
    assert len(led) == len(flown) == 120
    assert max(math.dist(*pair) for pair in zip(led, flown)) < 0.5
    assert flown[-1][0] > 0.9 and flown[-1][2] > 1.4
    assert picture.stat().st_size > 10_000
    sys.modules.pop("fly_outside")
    sys.modules.pop("without_ros")
