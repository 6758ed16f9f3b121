"""Parameters: some keys of config/drone.yaml, nested as in that file, with other values."""

import copy
from pathlib import Path

import yaml
from case import Case
from hypothesis import strategies as st

from kinds.values import junk, mostly, numbers, texts, vectors, words

_CONFIG = Path(__file__).parents[3] / "config"
_DEFAULTS, _SENSORS = (
    yaml.safe_load((_CONFIG / name).read_text(encoding="utf-8")) for name in ("drone.yaml", "sensors.yaml")
)
_CAMERA = _DEFAULTS["cameras"]["track"]


def _leaves(values, path=()):
    for key, value in values.items():
        yield (*path, key), value
        if isinstance(value, dict):
            yield from _leaves(value, (*path, key))


_KEYS = sorted([*_leaves(_DEFAULTS), *_leaves(_SENSORS)], key=lambda leaf: leaf[0])


_WORDS = [
    "3.x",
    "4.x",
    "color",
    "depth",
    "none",
    "target",
    "drone",
    "Track_base",
    "front_optical",
    "no_such_frame",
    "odom",
]


def _similar(value):
    """Return a strategy of values with the type of `value`, often close to it."""
    if isinstance(value, bool):
        return st.booleans()
    if isinstance(value, (str, dict)):
        return st.one_of(st.sampled_from(_WORDS), words, texts)
    if isinstance(value, list):
        return vectors(len(value))
    factors = st.sampled_from([0.5, 2, 3, 0.1, 10, 0.01, 100, 1e3, 1e-3])
    return st.one_of(factors.map(lambda factor: type(value)(value * factor)), factors.map(lambda f: value * f), numbers)


@st.composite
def _overrides(draw):
    overrides = copy.deepcopy(draw(st.sampled_from([{}, _SENSORS])))
    for _ in range(draw(st.integers(1, 3))):
        path, value = draw(st.sampled_from(_KEYS))
        if draw(st.integers(0, 19)) == 0:
            path = (*path[:-1], draw(st.one_of(words, texts)))
        place = overrides
        for key in path[:-1]:
            place = place.setdefault(key, {}) if isinstance(place, dict) else {}
        if isinstance(place, dict):
            place[path[-1]] = draw(mostly(_similar(value)))
    if draw(st.integers(0, 3)) == 0:  # another camera, like one that a user adds
        camera = {
            **_CAMERA,
            "topic": draw(st.sampled_from(["odom", "front", "track/camera_info", "new/image", "cmd_vel"])),
        }
        camera["object"] = draw(st.sampled_from(["TrackCam", "NewCam", "Drone", "Quadricopter_base"]))
        overrides.setdefault("cameras", {})
        if isinstance(overrides["cameras"], dict):
            overrides["cameras"]["another"] = camera
    return overrides


_ASSIGNMENTS = st.lists(
    st.builds(
        lambda leaf, value, equals: ".".join(leaf[0]) + equals + str(value),
        st.sampled_from(_KEYS),
        st.one_of(numbers, texts, junk),
        st.sampled_from(["="] * 9 + ["", "=="]),
    ),
    max_size=3,
)
CASES = st.one_of(
    st.builds(Case, st.just("parameters"), st.just({}), _overrides()),
    st.builds(Case, st.just("assignments"), st.just({}), _ASSIGNMENTS),
)
