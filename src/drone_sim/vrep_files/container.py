"""The outside of a V-REP file: its header, and the payload that may be compressed."""

from __future__ import annotations

import struct
from typing import NamedTuple

from drone_sim.files.resources import MEBIBYTE
from drone_sim.vrep_files import huffman
from drone_sim.vrep_files.errors import VrepFileError

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
        raise VrepFileError("is no file of V-REP or CoppeliaSim (it does not begin with VREP)")
    if len(content) < _PAYLOAD_AT:
        raise VrepFileError(f"is cut: {len(content)} bytes, and the header alone has {_PAYLOAD_AT}")
    _, version, oldest_reader, compression, length, _, program = _HEADER.unpack_from(content)
    if version < OLDEST or oldest_reader > NEWEST:
        raise VrepFileError(f"has format {version}; {OLDEST} (V-REP 3.0) to {NEWEST} (CoppeliaSim 4.9) can be read")
    if not 0 <= length <= MAX_PAYLOAD:
        raise VrepFileError(f"says that it has {length} bytes; at most {MAX_PAYLOAD} are read")
    return Container(version, program, _payload(content[_PAYLOAD_AT:], compression, length))


def _payload(data: bytes, compression: int, length: int) -> bytes:
    if compression == 1:
        return huffman.decode(data, length)
    if compression != 0:
        raise VrepFileError(f"has compression {compression}; 0 (none) and 1 (Huffman) can be read")
    if len(data) < length:
        raise VrepFileError(f"is cut: {len(data)} of {length} bytes are there")
    return data[:length]
