"""The container of a V-REP file: a header, and a payload that may be Huffman-coded, preceded by its tree.

The most significant bit of a byte comes first. The tree is stored in pre-order: a 1 and 8 bits are a leaf; a 0 is an
inner node, followed by its 0-child and its 1-child. The codes follow directly.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

from drone_sim.files.resources import MEBIBYTE
from drone_sim.vrep_files.model import VrepFileError

_MAX_LEAVES = 256
_MAX_DEPTH = 256


class _Node(dict[int, tuple[bytes, "_Node"]]):
    """A node of the tree, and a table: for the next 8 bits, the decoded bytes and the node reached after them.

    Entries are computed at their first use, so that a byte of the file costs one look-up.
    """

    __slots__ = ("children", "root")

    def __init__(self, root: _Node | None) -> None:
        super().__init__()
        self.root = self if root is None else root
        self.children: list[_Node | int] = []  # for bit 0 and bit 1; an int is a leaf

    def __missing__(self, byte: int) -> tuple[bytes, _Node]:
        entry = self[byte] = self.follow(byte, 8)
        return entry

    def follow(self, byte: int, count: int) -> tuple[bytes, _Node]:
        """Return the bytes decoded from the last `count` bits of a byte, and the node reached after them."""
        out, node = bytearray(), self
        for bit in range(count - 1, -1, -1):
            child = node.children[byte >> bit & 1]
            if isinstance(child, int):
                out.append(child)
                node = self.root
            else:
                node = child
        return bytes(out), node


class _Bits:
    """Reads single bits."""

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


def _decode(data: bytes, length: int) -> bytes:
    """Return the `length` bytes decoded from `data`. Raises VrepFileError."""
    bits = _Bits(data)
    if bits.take(1):
        raise VrepFileError("has a Huffman tree with a single leaf")
    node = _tree(bits)
    first, used = divmod(bits.position, 8)
    pieces = []
    if used:
        piece, node = node.follow(data[first], 8 - used)
        pieces.append(piece)
        first += 1
    for byte in memoryview(data)[first:]:
        piece, node = node[byte]
        pieces.append(piece)
    decoded = b"".join(pieces)
    if len(decoded) < length:
        raise VrepFileError(f"is truncated: {len(decoded)} of {length} bytes")
    return decoded[:length]


def _tree(bits: _Bits) -> _Node:
    root = _Node(None)
    unfinished, leaves = [root], 0
    while unfinished:
        node = unfinished[-1]
        if len(node.children) == 2:
            unfinished.pop()
        elif bits.take(1):
            node.children.append(bits.take(8))
            leaves += 1
        else:
            child = _Node(root)
            node.children.append(child)
            unfinished.append(child)
        if leaves > _MAX_LEAVES or len(unfinished) > _MAX_DEPTH:
            raise VrepFileError("has a Huffman tree with more than 256 leaves")
    return root


MAX_SIZE = 64 * MEBIBYTE  # bytes of a file
MAX_PAYLOAD = 256 * MEBIBYTE  # bytes, uncompressed
OLDEST, NEWEST = 16, 25  # serialization versions: V-REP 3.0 to CoppeliaSim 4.9
_MAGIC = b"VREP"
_HEADER = struct.Struct("<4siiBiiH")
_HEADER_SIZE = 1021


class Container(NamedTuple):
    """Serialization version, program version (30601 is 3.6.1), and payload."""

    version: int
    program: int
    payload: bytes


def open_container(content: bytes) -> Container:
    """Return the container of a file. Raises VrepFileError."""
    if not content:
        raise VrepFileError("is empty")
    if not content.startswith(_MAGIC):
        raise VrepFileError("is not a file of V-REP or CoppeliaSim (it does not begin with VREP)")
    if len(content) < _HEADER_SIZE:
        raise VrepFileError(f"is truncated: it has {len(content)} bytes, the header alone {_HEADER_SIZE}")
    _, version, oldest_reader, compression, length, _, program = _HEADER.unpack_from(content)
    if version < OLDEST or oldest_reader > NEWEST:
        raise VrepFileError(f"has format {version}; supported are {OLDEST} (V-REP 3.0) to {NEWEST} (CoppeliaSim 4.9)")
    if not 0 <= length <= MAX_PAYLOAD:
        raise VrepFileError(f"declares a payload of {length} bytes; at most {MAX_PAYLOAD} are allowed")
    return Container(version, program, _payload(content[_HEADER_SIZE:], compression, length))


def _payload(data: bytes, compression: int, length: int) -> bytes:
    if compression == 1:
        return _decode(data, length)
    if compression != 0:
        raise VrepFileError(f"has compression {compression}; supported are 0 (none) and 1 (Huffman)")
    if len(data) < length:
        raise VrepFileError(f"is truncated: {len(data)} of {length} bytes")
    return data[:length]
