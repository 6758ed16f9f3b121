"""Scripts that lack something of the tutorial's, and the criteria that they should fail because of it."""

from pathlib import Path
from typing import NamedTuple

STAGES = Path(__file__).resolve().parents[2] / "docs" / "tutorial"


class Case(NamedTuple):
    """A script, and the names of criteria of a task that it fails, and of some that it passes, on every seed."""

    task: str
    what: str
    script: str
    fails: tuple[str, ...]
    passes: tuple[str, ...] = ()


def cases(folder):
    """Write the scripts into a folder; return all cases."""
    return [*_stages(folder), *_slips(folder)]


def _stages(folder):
    """Return the stages of the tutorial, each of which lacks the loops of those after it."""
    whole = ("height", "spin", "pitch", "roll", "all at once", "guard")
    for number, name in enumerate(("1_thrust", "2_elevation", "3_yaw", "4_pitch", "5_roll", "6_ros")):
        known = min(number, 4) + (number >= 4)  # the last two have all loops, and no guard
        script = folder / f"stage_{name}.py"
        source = (STAGES / f"{name}.py").read_text(encoding="utf-8")
        # Its plan would fly it about: the loops alone are tested here.
        script.write_text(source.replace("def flight_plan(t):", "def flight_plan(_t):\n    return [0] * 6\n\n\ndef _(t):"))
        yield Case("stability", f"stage {name}", str(script), (whole[known],), whole[:known])


def _slips(folder):
    """Return the tutorial's stage 6 with one slip each."""
    source = (STAGES / "6_ros.py").read_text(encoding="utf-8")
    slips = {
        "no elevation": ("self.thrust = self.thrust_gravity + ", "self.thrust = self.thrust_gravity + 0 * ", ("up rises",), ()),
    }
    for what, (right, slip, fails, passes) in slips.items():
        if right not in source:
            raise ValueError(f"6_ros.py has no {right!r}")
        script = folder / f"{what.replace(' ', '_')}.py"
        script.write_text(source.replace(right, slip), encoding="utf-8")
        yield Case("steps", what, str(script), fails, passes)
