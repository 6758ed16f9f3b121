"""Texts of a file as names that a scene file, or the disk, may have."""

from __future__ import annotations

import re

from drone_sim.wording import MAX_NAME


def label(text: str) -> str:
    """Return a text as a scene file may have it as a name: printable and not too long."""
    return "".join(letter if letter.isprintable() else "_" for letter in text)[:MAX_NAME]


def word(name: str, otherwise: str) -> str:
    """Return a name of letters, digits and _ alone, a letter first: for files, topics and vehicles."""
    plain = re.sub(r"[^A-Za-z0-9_]+", "_", name).strip("_")[:48]
    return plain if re.match(r"[A-Za-z]", plain) else f"{otherwise}_{plain}".rstrip("_")
