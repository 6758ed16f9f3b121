"""Requests of remote API clients: lists of messages as bytes, most of them calls of the scripts' functions."""

import cbor2
from case import Case
from hypothesis import strategies as st

from kinds.scripts import FUNCTIONS, OBJECTS, ROS_FUNCTIONS
from kinds.values import ODD_TEXTS, junk, mostly, mutated, vectors

_CONTROL = (
    *("startSimulation", "stopSimulation", "pauseSimulation", "setStepping", "step", "wait", "testCB", "yield"),
    *("acquireLock", "releaseLock", "handleExtCalls", "getSimulationState", "switchThread"),
)
_FUNCTION = st.one_of(
    st.sampled_from(
        [*(f"sim.{name}" for name in (*FUNCTIONS, *_CONTROL)), *(f"simROS.{name}" for name in ROS_FUNCTIONS)]
    ),
    st.sampled_from([f"sim.{name}" for name in _CONTROL]),
    st.sampled_from(["zmqRemoteApi.info", "zmqRemoteApi.require", "_*executed*_", "_*end*_", "_*wait*_"]),
    st.sampled_from([one for one in ODD_TEXTS if len(one) < 1000]),
)
_VALUES = st.one_of(
    st.integers(-2, 30),
    vectors(),
    st.sampled_from([*OBJECTS, "mine@func", "_*NIL*_", b"\xff\x00", "std_msgs/Float64"]),
    st.builds(
        cbor2.CBORTag, st.sampled_from([0, 1, 2, 4, 5, 28, 29, 30, 35, 64, 86, 258, 55799]), st.binary(max_size=16)
    ),
    junk,
)
_FIELDS = st.fixed_dictionaries(
    {"func": mostly(_FUNCTION), "args": mostly(st.lists(_VALUES, max_size=5))},
    optional={
        "uuid": mostly(st.sampled_from(["a", "b"])),
        "timeout": junk,
        "argsL": st.integers(-1, 9),
        "eval": st.just("os.exit()"),
    },
)


def _encode(fields):
    try:
        return cbor2.dumps(fields, default=lambda encoder, value: encoder.encode(str(value)))
    except ValueError:  # a lone surrogate, or a number that is too large
        return b"\xff"


_MESSAGE = st.one_of(_FIELDS.map(_encode), _FIELDS.map(_encode).flatmap(mutated), st.binary(max_size=40))
CASES = st.builds(Case, st.just("requests"), st.just({}), st.lists(_MESSAGE, min_size=1, max_size=8))
