"""What a terminal sends, in one piece and in several, and which keys it was."""

import pytest

from drone_sim.ros.tools.commands import (
    BACKSPACE,
    DOWN,
    ENTER,
    ESCAPE,
    KEY_PATIENCE,
    LEFT,
    RIGHT,
    UNKNOWN,
    UP,
    KeyDecoder,
)


@pytest.fixture
def decoder(clock):
    return KeyDecoder(clock)


SEQUENCES = [
    (b"\x1b[A", [UP]),
    (b"\x1bOB", [DOWN]),
    (b"\x1b[1;5C", [RIGHT]),
    (b"\x1bO2D", [LEFT]),
    (b"\x1b\x1b[A", [UP]),  # with Alt
    (b"\x1b[A\x1b[A\x1b[D", [UP, UP, LEFT]),
    (b"\x1b[5~", [UNKNOWN]),
    (b"\x1b[[A", [UNKNOWN]),  # F1 of the Linux console
    (b"\x1bOP", [UNKNOWN]),
    (b"\x1b[?1;2c", [UNKNOWN]),
    (b"\x1bq", [UNKNOWN]),
    (b"\x1b[\x1b[A", [UNKNOWN, UP]),  # one that was cut off
    ("é".encode(), [UNKNOWN]),
    (b"\x00\x01", [UNKNOWN, UNKNOWN]),
    (b"\x7f\x08", [BACKSPACE, BACKSPACE]),
    (b"\r\n", [ENTER, ENTER]),
    (b"eR q", ["e", "R", " ", "q"]),
]


@pytest.mark.parametrize(("sent", "keys"), SEQUENCES)
def test_sequences_at_once(decoder, sent, keys):
    assert decoder.feed(sent) == keys


@pytest.mark.parametrize(("sent", "keys"), [pair for pair in SEQUENCES if pair[0][:1] != b"\xc3"])
def test_sequences_in_single_bytes_from_a_slow_line(decoder, clock, sent, keys):
    came = []
    for byte in sent:
        came += decoder.feed(bytes([byte]))
        clock.now += 0.4 * KEY_PATIENCE
        came += decoder.feed(b"")
        clock.now += 0.4 * KEY_PATIENCE
        came += decoder.feed(b"")
    assert came == keys


def test_only_an_escape_that_nothing_follows_is_the_key(decoder, clock):
    assert decoder.feed(b"\x1b") == []
    clock.now += 0.9 * KEY_PATIENCE
    assert decoder.feed(b"") == []
    clock.now += 0.2 * KEY_PATIENCE
    assert decoder.feed(b"") == [ESCAPE]
    assert decoder.feed(b"[A") == ["[", "A"]


def test_a_sequence_that_does_not_go_on_is_dropped(decoder, clock):
    assert decoder.feed(b"\x1b[1;") == []
    clock.now += KEY_PATIENCE
    assert decoder.feed(b"") == [UNKNOWN]
    assert decoder.feed(b"u") == ["u"]
