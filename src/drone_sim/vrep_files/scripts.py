"""Scripts: on what they are, what kind they are, their text, and their parameters."""

from __future__ import annotations

from drone_sim.vrep_files.chunks import Texts, decoded, level
from drone_sim.vrep_files.model import VrepFileError, VrepScript

_KINDS = {0: "main", 1: "child", 6: "customization"}
_DISABLED, _PARENT_IS_PROXY, _OWN_MAIN = 2, 4, 8
_MOST_PARAMETERS = 10_000


def read_script(data: bytes, owner: int | None = None) -> VrepScript:
    """Return a script; `owner` is the handle of the object that it acts on, None where the file says so itself.

    Raises VrepFileError.
    """
    own = level(data)
    switches = own.bits("Va2", default=_OWN_MAIN)
    _, said, number = own.integers("Si2", count=3) or (0, -1, -1)
    override = own.integer("Coc", default=-1)
    on = owner if owner is not None else override if override >= 0 else said
    kind = _KINDS.get(number, f"of type {number}")
    language = own.text("Lne").lower()
    text = _plain_text(own.find("Ste") or b"")
    return VrepScript(
        object=on,
        kind=kind,
        text=text,
        is_enabled=not switches & _DISABLED,
        language="python" if "python" in language or text.startswith("#python") else "lua",
        parameters=read_parameters(own.find("Prm")),
        parent_is_proxy=bool(switches & _PARENT_IS_PROXY),
        is_stock_main=kind == "main" and (not switches & _OWN_MAIN or "defaultMainScript" in text),
    )


def read_parameters(data: bytes | None) -> tuple[tuple[str, str], ...]:
    """Return names and values, as texts. Raises VrepFileError."""
    listed = None if data is None else level(data).find("Par")
    if listed is None:
        return ()
    texts = Texts(listed, "Par")
    count = texts.integer()
    if not 0 <= count <= _MOST_PARAMETERS:
        raise VrepFileError(f"Par: {count} script parameters; at most {_MOST_PARAMETERS} are read")
    found = []
    for _ in range(count):
        name, _unit, value = texts.text(), texts.text(), texts.text()
        texts.integer()
        found.append((name, value))
    return tuple(found)


def unscrambled(data: bytes) -> bytes:
    """Return the text of a script, of which the file hides all but the first and the last byte."""
    if len(data) < 3:
        return data
    first, last = _signed(data[0]), _signed(data[-1])
    start, end = int(first / 2), 3 * last  # the division goes toward zero
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
