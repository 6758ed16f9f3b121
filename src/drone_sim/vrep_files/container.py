"""The container of a V-REP file: its header, and the payload, which may be Huffman-coded, with the tree in front.

The bits of a byte count from the most significant one. The tree stands in pre-order: 1 and 8 bits are a leaf, 0 is
a node, after which its 0-child and its 1-child come. The codes follow at once.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

from drone_sim.files.resources import MEBIBYTE
from drone_sim.vrep_files.model import VrepFileError

_MOST_LEAVES = 256
_DEEPEST = 256


class _Node(dict[int, tuple[bytes, "_Node"]]):
    """A node of the tree, and a table: of the 8 bits to come, what they stand for, and the node after them.

    An entry is made when it is first asked for: a byte of the file then costs one look-up.
    """

    __slots__ = ("children", "root")

    def __init__(self, root: _Node | None) -> None:
        super().__init__()
        self.root = self if root is None else root
        self.children: list[_Node | int] = []  # of bit 0 and bit 1; an int is a leaf

    def __missing__(self, byte: int) -> tuple[bytes, _Node]:
        entry = self[byte] = self.follow(byte, 8)
        return entry

    def follow(self, byte: int, count: int) -> tuple[bytes, _Node]:
        """Return what the last `count` bits of a byte stand for, and the node after them."""
        out, here = bytearray(), self
        for bit in range(count - 1, -1, -1):
            child = here.children[byte >> bit & 1]
            if isinstance(child, int):
                out.append(child)
                here = self.root
            else:
                here = child
        return bytes(out), here


class _Bits:
    """Reads the bits of the tree one after the other."""

    def __init__(self, data: bytes):
        self.data = data
        self.position = 0

    def take(self, count: int) -> int:
        value = 0
        for _ in range(count):
            byte, bit = divmod(self.position, 8)
            if byte >= len(self.data):
                raise VrepFileError("ends within its Huffman tree")
            value = value << 1 | self.data[byte] >> (7 - bit) & 1
            self.position += 1
        return value


def _decoded(data: bytes, length: int) -> bytes:
    """Return the `length` bytes that `data` stands for. Raises VrepFileError."""
    bits = _Bits(data)
    if bits.take(1):
        raise VrepFileError("has a Huffman tree of one leaf")
    here = _tree(bits)
    first, used = divmod(bits.position, 8)
    pieces = []
    if used:
        piece, here = here.follow(data[first], 8 - used)
        pieces.append(piece)
        first += 1
    for byte in memoryview(data)[first:]:
        piece, here = here[byte]
        pieces.append(piece)
    decoded = b"".join(pieces)
    if len(decoded) < length:
        raise VrepFileError(f"is cut off: it has {len(decoded)} of {length} bytes")
    return decoded[:length]


def _tree(bits: _Bits) -> _Node:
    root = _Node(None)
    unfinished, leaves = [root], 0
    while unfinished:
        here = unfinished[-1]
        if len(here.children) == 2:
            unfinished.pop()
        elif bits.take(1):
            here.children.append(bits.take(8))
            leaves += 1
        else:
            child = _Node(root)
            here.children.append(child)
            unfinished.append(child)
        if leaves > _MOST_LEAVES or len(unfinished) > _DEEPEST:
            raise VrepFileError("has a Huffman tree of more than 256 leaves")
    return root


MAX_SIZE = 64 * MEBIBYTE  # bytes of a file
MAX_PAYLOAD = 256 * MEBIBYTE  # bytes, uncompressed
OLDEST, NEWEST = 16, 25  # serialization versions: V-REP 3.0 to CoppeliaSim 4.9
_MAGIC = b"VREP"
_HEADER = struct.Struct("<4siiBiiH")
_PAYLOAD_AT = 1021


class Container(NamedTuple):
    """Serialization version, program version (30601 is 3.6.1), and the payload."""

    version: int
    program: int
    payload: bytes


def open_container(content: bytes) -> Container:
    """Return what a file holds. Raises VrepFileError."""
    if not content:
        raise VrepFileError("is empty")
    if not content.startswith(_MAGIC):
        raise VrepFileError("is not a file of V-REP or CoppeliaSim (it does not begin with VREP)")
    if len(content) < _PAYLOAD_AT:
        raise VrepFileError(f"is cut off: it has {len(content)} bytes, and the header alone needs {_PAYLOAD_AT}")
    _, version, oldest_reader, compression, length, _, program = _HEADER.unpack_from(content)
    if version < OLDEST or oldest_reader > NEWEST:
        raise VrepFileError(f"has format {version}; {OLDEST} (V-REP 3.0) to {NEWEST} (CoppeliaSim 4.9) can be read")
    if not 0 <= length <= MAX_PAYLOAD:
        raise VrepFileError(f"has {length} bytes according to its header; at most {MAX_PAYLOAD} are read")
    return Container(version, program, _payload(content[_PAYLOAD_AT:], compression, length))


def _payload(data: bytes, compression: int, length: int) -> bytes:
    if compression == 1:
        return _decoded(data, length)
    if compression != 0:
        raise VrepFileError(f"has compression {compression}; 0 (none) and 1 (Huffman) can be read")
    if len(data) < length:
        raise VrepFileError(f"is cut off: it has {len(data)} of {length} bytes")
    return data[:length]
