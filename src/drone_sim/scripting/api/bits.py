"""`sim`: whole numbers, bit by bit, as V-REP's Lua 5.1 has no operators for them."""

from __future__ import annotations

from drone_sim.scripting.api.calls import WrongValue

_MASK = 0xFFFFFFFF


class Bits:
    """The functions on bits, of 32-bit numbers."""

    def boolOr32(self, first: int, second: int) -> int:
        """Return the bits that either number has."""
        return _whole(first) | _whole(second)

    def boolAnd32(self, first: int, second: int) -> int:
        """Return the bits that both numbers have."""
        return _whole(first) & _whole(second)

    def boolXor32(self, first: int, second: int) -> int:
        """Return the bits that one number alone has."""
        return _whole(first) ^ _whole(second)

    boolOr16, boolAnd16, boolXor16 = boolOr32, boolAnd32, boolXor32


def _whole(value: float) -> int:
    if not isinstance(value, (int, float)) or value != value // 1 or abs(value) > _MASK:
        raise WrongValue("whole numbers of 32 bits are expected")
    return int(value) & _MASK
