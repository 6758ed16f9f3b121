"""Decoding of the key sequences that a terminal sends, in one piece and in several."""

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
    (b"\x1b[\x1b[A", [UNKNOWN, UP]),  # an incomplete sequence, then Up
    ("é".encode(), [UNKNOWN]),
    (b"\x00\x01", [UNKNOWN, UNKNOWN]),
    (b"\x7f\x08", [BACKSPACE, BACKSPACE]),
    (b"\r\n", [ENTER, ENTER]),
    (b"eR q", ["e", "R", " ", "q"]),
]


@pytest.mark.parametrize(("sent", "keys"), SEQUENCES)
def test_sequences_that_arrive_in_one_piece_are_decoded(decoder, sent, keys):
    assert decoder.feed(sent) == keys


@pytest.mark.parametrize(("sent", "keys"), [pair for pair in SEQUENCES if pair[0][:1] != b"\xc3"])
def test_sequences_that_arrive_byte_by_byte_are_decoded(decoder, clock, sent, keys):
    decoded = []
    for byte in sent:
        decoded += decoder.feed(bytes([byte]))
        clock.now += 0.4 * KEY_PATIENCE
        decoded += decoder.feed(b"")
        clock.now += 0.4 * KEY_PATIENCE
        decoded += decoder.feed(b"")
    assert decoded == keys


def test_an_escape_byte_without_a_successor_is_the_escape_key(decoder, clock):
    assert decoder.feed(b"\x1b") == []
    clock.now += 0.9 * KEY_PATIENCE
    assert decoder.feed(b"") == []
    clock.now += 0.2 * KEY_PATIENCE
    assert decoder.feed(b"") == [ESCAPE]
    assert decoder.feed(b"[A") == ["[", "A"]


def test_an_incomplete_sequence_becomes_an_unknown_key_after_a_timeout(decoder, clock):
    assert decoder.feed(b"\x1b[1;") == []
    clock.now += KEY_PATIENCE
    assert decoder.feed(b"") == [UNKNOWN]
    assert decoder.feed(b"u") == ["u"]
