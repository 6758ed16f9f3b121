"""Timelines for `fly`, and its other arguments."""

from case import Case
from hypothesis import strategies as st

from kinds.values import as_yaml, junk, mostly, mutated, numbers, texts, vectors, words

_ACTIONS = {
    "twist": ("linear", "angular"),
    "pose": ("position", "rpy"),
    "push": ("force", "torque"),
    "weather": ("wind", "gusts"),
    "faults": ("propellers", "sensors"),
}
_GOOD = b"- {at: 0.1, twist: {linear: [1, 0, 0]}}\n- {at: 0.2, push: {force: [1, 0, 0], duration: 0.2}}\n"


@st.composite
def _entry(draw):
    kind = draw(mostly(st.sampled_from(sorted(_ACTIONS)), texts))
    action = {}
    for key in _ACTIONS.get(kind, ("linear",)):
        if draw(st.booleans()):
            action[key] = draw(vectors())
    if kind == "push":
        action["duration"] = draw(mostly(st.floats(0.01, 1), st.one_of(numbers, junk)))
    if draw(st.integers(0, 19)) == 0:
        action[draw(words)] = draw(junk)
    entry = {"at": draw(mostly(st.floats(0, 0.5), st.one_of(numbers, junk))), kind: draw(mostly(st.just(action), junk))}
    if draw(st.integers(0, 19)) == 0:
        entry[draw(texts)] = draw(junk)
    return entry


_TEXTS = st.one_of(
    st.lists(mostly(_entry(), junk), max_size=5).map(as_yaml),
    mutated(_GOOD),
    st.sampled_from(
        [b"- " * 2000, b"&x [*x]", b"[" * 5000, b"- {at: 1:30, pose: {}}", b"\xff", b"- {at: 0, at: 1, pose: {}}"]
    ),
)
_DURATION = st.one_of(st.just("0.5"), st.just("0.5"), numbers.filter(lambda x: not 10 < x < 1e300).map(str), texts)
_ARGUMENTS = st.lists(
    st.sampled_from(
        ["--csv=out.csv", "--csv=/dev/full", "--csv=.", "--csv=none/out.csv", "--set=control.Kzref=4", "--no"]
    ),
    max_size=2,
)
CASES = st.builds(
    lambda text, duration, arguments: Case("fly", {"flight.yaml": text}, [f"--duration={duration}", *arguments]),
    _TEXTS,
    _DURATION,
    _ARGUMENTS,
)
