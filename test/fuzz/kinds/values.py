"""Odd numbers, texts and structures, which the other kinds use."""

import datetime
import math

import yaml
from hypothesis import strategies as st

ODD_NUMBERS = (
    *(0, 0.0, -0.0, 1, -1, 0.5, -1e-9, 1e-9, 5e-324, 2.2e-308, 1e-300, 1e-30, 1e9, -1e9, 1e30, 1e154, 1e155, 1e300),
    *(1.7976931348623157e308, math.inf, -math.inf, math.nan, 2**31, 2**31 - 1, -(2**31), 2**53, 2**63, 10**30, 10**400),
)
LONG = "x" * 300
ODD_TEXTS = (
    *("", " ", "none", "null", "~", "true", "1:30", "0x10", "1_000", "é", "日本", "\U0001f681", "a\nb", "a\tb", "\x00"),
    *(
        "\x1b[31m",
        "%s %d",
        "{0}",
        "..",
        ".",
        "/",
        "//",
        "~",
        "~nobody_here/x",
        "/dev/null",
        "/dev/zero",
        "/proc/self/mem",
    ),
    *(
        "package://",
        "package:///",
        "package://drone_sim",
        "package://drone_sim/urdf",
        "package://no_such/x",
        "file:///etc",
    ),
    *("Drone", "Quadricopter_base", "front", "world", "odom", "../" * 30, LONG, LONG + "/" + LONG, "x" * 100_000),
)

small = st.floats(-10, 10, width=32)
numbers = st.one_of(small, st.sampled_from(ODD_NUMBERS), st.integers(-3, 100), st.floats())
finite = st.one_of(small, st.floats(-1e3, 1e3), st.floats(allow_nan=False, allow_infinity=False))
words = st.text("abcdefgxyz_0123456789", min_size=1, max_size=8)
texts = st.one_of(st.sampled_from(ODD_TEXTS), words, st.text(max_size=12))
scalars = st.one_of(st.none(), st.booleans(), numbers, texts, st.just(datetime.date(2020, 2, 30 - 1)))
junk = st.recursive(
    scalars,
    lambda inner: st.one_of(
        st.lists(inner, max_size=4),
        st.dictionaries(st.one_of(words, st.sampled_from([None, 1, 2.5, True, ""])), inner, max_size=3),
    ),
    max_leaves=8,
)


def one_of_words(text: str) -> st.SearchStrategy:
    return st.sampled_from(text.split())


def mostly(good: st.SearchStrategy, bad: st.SearchStrategy = junk) -> st.SearchStrategy:
    """Return `good` most of the time, so that a structure of many values is not refused for its first value."""
    return st.sampled_from([good] * 30 + [bad]).flatmap(lambda one: one)


def vectors(count: int = 3) -> st.SearchStrategy:
    """Return lists of `count` numbers, sometimes other lists or junk."""
    return mostly(st.lists(small, min_size=count, max_size=count), st.one_of(st.lists(numbers, max_size=7), junk))


@st.composite
def mutated(draw: st.DrawFn, content: bytes) -> bytes:
    """Return the bytes after up to three mutations: truncated, flipped, dropped, repeated, or with odd text."""
    for _ in range(draw(st.integers(0, 3))):
        at = draw(st.integers(0, max(len(content), 1)))
        how = draw(st.sampled_from(["cut", "flip", "drop", "repeat", "stuff"]))
        if how == "cut":
            content = content[:at]
        elif how == "flip":
            content = content[:at] + draw(st.binary(min_size=1, max_size=4)) + content[at + 4 :]
        elif how == "drop":
            content = content[:at] + content[at + draw(st.integers(1, 40)) :]
        elif how == "repeat":
            content = content[:at] + content[max(at - 30, 0) : at] * draw(st.integers(2, 50)) + content[at:]
        else:
            odd = draw(st.sampled_from(ODD_NUMBERS[:-1] + ODD_TEXTS))
            content = content[:at] + str(odd).encode("utf-8", "replace") + content[at:]
    return content


def as_yaml(value):
    try:
        return yaml.safe_dump(value, allow_unicode=True).encode("utf-8", "surrogatepass")
    except (yaml.YAMLError, ValueError, TypeError):
        return repr(value).encode("utf-8", "replace")
