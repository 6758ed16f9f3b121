#!/usr/bin/env python3
"""Write the table of parameters in docs/interface.md, from config/drone.yaml: its keys, values and comments.

PYTHONPATH=src python docs/write_interface.py
"""

import re
from pathlib import Path

from drone_sim.config.fields import CONFIG, rows
from drone_sim.hosting.tunable import tunables
from drone_sim.run import parameters
from drone_sim.run.pacing import FACTOR

PAGE = Path(__file__).resolve().parents[1] / "docs/interface.md"
BEGIN, END = "<!-- parameters: begin -->\n", "<!-- parameters: end -->\n"

_CAMERA = re.compile(r"^cameras/(\w+)/")


def tuned_names() -> dict[str, list[str]]:
    """Return what each parameter is called where it is tuned, by its name in the table."""
    found: dict[str, list[str]] = {FACTOR: [FACTOR]}  # by the node's server, the others by a vehicle's
    for name, leaf in tunables(parameters.load().fleet[0], {}).items():
        keys = [one for one in leaf.location if isinstance(one, str)]
        found.setdefault("/".join(keys), []).append(name)
    return found


def table() -> str:
    """Return the table. Of the cameras, which are all of one kind, the keys that the first has stand for all."""
    lines, cameras = ["| parameter | default | in flight | |", "|---|---|---|---|"], set()
    tuned = tuned_names()
    for name, default, comment in rows(CONFIG.read_text(encoding="utf-8")):
        camera = _CAMERA.match(name)
        if camera:
            key = name[camera.end() :]
            if key in cameras:
                continue
            cameras.add(key)
            name = f"cameras/{camera[1]}/{key}"
        live = ", ".join(f"`{one}`" for one in tuned.get(name, ()))
        cells = (f"`{name}`", f"`{default}`" if default else "", live, comment.replace("|", "\\|").replace("<", "&lt;"))
        lines.append(f"| {' | '.join(cells)} |".replace("|  |", "| |"))
    return "\n".join(lines) + "\n"


def page(text: str) -> str:
    """Return the page with the table in its place."""
    before, rest = text.split(BEGIN)
    return f"{before}{BEGIN}{table()}{END}{rest.split(END)[1]}"


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
