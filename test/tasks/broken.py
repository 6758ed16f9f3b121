"""Variants of the tutorial's scripts with a missing or wrong part, and the criteria that they must fail."""

from pathlib import Path
from typing import Any, NamedTuple

STAGES = Path(__file__).resolve().parents[2] / "docs" / "tutorial"
BARE = {"control": {"thrust_limits": None, "recovery_margin": None}}
LOOPS = ("height", "spin", "pitch", "roll", "guard")  # each stage adds one of these, but the last
ALL_LOOPS = ("height", "spin", "pitch", "roll", "all at once")
# One mistake each in the tutorial's stage 6: original text, replacement, criteria that fail, criteria that pass.
MISTAKES = {
    "a thrust_gravity of 5": ('"thrust_gravity": 5.33', '"thrust_gravity": 5', ["up settles"], ["turn settles"]),
    "vertical speed not braked": ("(twist[2] - d_global_pos[2])", "twist[2]", ["up settles"], ["turn settles"]),
    "yaw speed not measured": ("(twist[5] - d_global_ori[2])", "twist[5]", ["turn settles"], ["forward settles"]),
    "no front speed": ("target_angle(twist[0], d_local_pos[0])", "0", ["forward rises"], ["left settles"]),
    "no lateral speed": ("target_angle(twist[1], d_local_pos[1])", "0", ["left rises"], ["forward settles"]),
    "pitch not damped": ('- gain("Dangle") * dpitch', "", ["forward overshoots"], []),
    "a lean to the wrong side": ("roll = -local_ori[0]", "roll = local_ori[0]", ["no_contact"], []),
    "no subscription": ('simROS.subscribe("/drone/cmd_vel"', 'simROS.subscribe("/other"', ["forward rises"], []),
}


class Case(NamedTuple):
    """A script, and names of criteria of a task that it fails and that it passes on every seed."""

    task: str
    what: str
    script: str
    fails: tuple[str, ...]
    passes: tuple[str, ...] = ()
    changes: Any = None  # keys of config/drone.yaml


def cases(folder):
    return [*_stages(folder), Case("stability", "the bare law", "", ("guard",), ALL_LOOPS, BARE), *_mistakes(folder)]


def _stages(folder):
    """Yield the stages of the tutorial; each lacks the control loops of the later stages."""
    for number, name in enumerate(("1_thrust", "2_elevation", "3_yaw", "4_pitch", "5_roll", "6_ros")):
        known = min(number, len(LOOPS) - 1)
        source = (STAGES / f"{name}.py").read_text(encoding="utf-8")
        # Without the flight plan, since only the control loops are tested here.
        source = source.replace("def flight_plan(t):", "def flight_plan(_):\n    return [0] * 6")
        script = _write(folder, name, source)
        yield Case("stability", f"stage {name}", script, (LOOPS[known],), LOOPS[:known])


def _mistakes(folder):
    """Yield the tutorial's stage 6 with one mistake each."""
    source = (STAGES / "6_ros.py").read_text(encoding="utf-8")
    for what, (right, wrong, fails, passes) in MISTAKES.items():
        if right not in source:
            raise ValueError(f"6_ros.py has no {right!r}")
        script = _write(folder, what.replace(" ", "_"), source.replace(right, wrong))
        yield Case("steps", what, script, tuple(fails), tuple(passes))


def _write(folder, name, source):
    """Write a script; return its path."""
    path = folder / f"{name}.py"
    path.write_text(source, encoding="utf-8")
    return str(path)
