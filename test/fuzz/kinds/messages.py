"""Messages on the drone's topics: lists of (topic, fields) for the real callbacks."""

from case import Case
from hypothesis import strategies as st

from kinds.values import ODD_NUMBERS, ODD_TEXTS, small

_FLOATS = st.one_of(small, st.sampled_from([float(x) for x in ODD_NUMBERS[:-1]]), st.floats())  # as float64 fields hold
_FRAMES = st.one_of(st.sampled_from(["", "world", "/world", "base_link", "World", *ODD_TEXTS]), st.text(max_size=9))
_TRIPLE = st.tuples(_FLOATS, _FLOATS, _FLOATS)
_PLACE = st.one_of(st.tuples(small, small, st.floats(0, 5)), _TRIPLE)
_TURN = st.one_of(
    st.sampled_from([(0.0, 0.0, 0.0, 1.0), (1.0, 0.0, 0.0, 0.0), (0.5, 0.5, 0.5, 0.5), (0.0, 0.0, 0.0, 0.0)]),
    st.tuples(_FLOATS, _FLOATS, _FLOATS, _FLOATS),
)
_POSE = st.fixed_dictionaries({"frame": _FRAMES, "position": _PLACE, "orientation": _TURN})
_MESSAGE = st.one_of(
    st.tuples(st.just("cmd_vel"), st.fixed_dictionaries({"linear": _TRIPLE, "angular": _TRIPLE})),
    st.tuples(st.sampled_from(["set_pose", "target_pose", "initialpose"]), _POSE),
    st.tuples(st.just("push"), st.fixed_dictionaries({"frame": _FRAMES, "force": _TRIPLE, "torque": _TRIPLE})),
    st.tuples(
        st.just("markers/feedback"),
        st.fixed_dictionaries(
            {
                "frame": _FRAMES,
                "position": _PLACE,
                "orientation": _TURN,
                "client": st.sampled_from(["", "rviz", "other"]),
                "marker": st.sampled_from(["Drone", "DronePosition", "", "Floor", "x" * 300]),
                "event": st.integers(0, 255),
            }
        ),
    ),
)
CASES = st.builds(Case, st.just("messages"), st.just({}), st.lists(_MESSAGE, min_size=1, max_size=8))
