"""Reads scripts: their object, kind, text and parameters."""

from __future__ import annotations

from drone_sim.vrep_files.chunks import Texts, decoded, level
from drone_sim.vrep_files.model import VrepFileError, VrepScript

_KINDS = {0: "main", 1: "child", 6: "customization"}
_DISABLED, _PARENT_IS_PROXY, _OWN_MAIN = 2, 4, 8
_MAX_PARAMETERS = 10_000


def read_script(data: bytes, owner: int | None = None) -> VrepScript:
    """Return a script. `owner` is the handle of the object that it is attached to; None: the file contains it.

    Raises VrepFileError.
    """
    script = level(data)
    switches = script.bits("Va2", default=_OWN_MAIN)
    _, stored, number = script.integers("Si2", count=3) or (0, -1, -1)
    override = script.integer("Coc", default=-1)
    handle = owner if owner is not None else override if override >= 0 else stored
    kind = _KINDS.get(number, f"of type {number}")
    language = script.text("Lne").lower()
    text = _plain_text(script.find("Ste") or b"")
    return VrepScript(
        object=handle,
        kind=kind,
        text=text,
        is_enabled=not switches & _DISABLED,
        language="python" if "python" in language or text.startswith("#python") else "lua",
        parameters=read_parameters(script.find("Prm")),
        parent_is_proxy=bool(switches & _PARENT_IS_PROXY),
        is_stock_main=kind == "main" and (not switches & _OWN_MAIN or "defaultMainScript" in text),
    )


def read_parameters(data: bytes | None) -> tuple[tuple[str, str], ...]:
    """Return the names and values of script parameters. Raises VrepFileError."""
    parameters = None if data is None else level(data).find("Par")
    if parameters is None:
        return ()
    texts = Texts(parameters, "Par")
    count = texts.integer()
    if not 0 <= count <= _MAX_PARAMETERS:
        raise VrepFileError(f"Par: {count} script parameters; at most {_MAX_PARAMETERS} are allowed")
    pairs = []
    for _ in range(count):
        name, _unit, value = texts.text(), texts.text(), texts.text()
        texts.integer()
        pairs.append((name, value))
    return tuple(pairs)


def unscrambled(data: bytes) -> bytes:
    """Return the text of a script. The file scrambles all but its first and last byte."""
    if len(data) < 3:
        return data
    first, last = _signed(data[0]), _signed(data[-1])
    start, end = int(first / 2), 3 * last  # truncated toward zero
    plain = bytearray(data)
    for index in range(1, len(data) - 1):
        change = 0
        if index & 1:
            change += index + start + end
        if index & 2:
            change -= 3 * index + start
        if index & 4:
            change += index // 2 + end
        plain[index] = data[index] + change & 0xFF
    return bytes(plain)


def _signed(byte: int) -> int:
    return byte - 256 if byte > 127 else byte


def _plain_text(data: bytes) -> str:
    text = decoded(unscrambled(data).rstrip(b"\0")).replace("\r\n", "\n").replace("\r", "\n").replace("\0", "")
    return text.removeprefix("--lua\n")
