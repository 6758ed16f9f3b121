"""Fly anew what CoppeliaSim recorded of its quadricopter, and compare: a table, and with --docs docs/fidelity.md.

FOLDER is a clone of the public repository OBulun/Coppelia-Quad; nothing of it is kept here.
"""

import argparse
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import flights
import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import matplotlib.pyplot as plt

ROOT = Path(__file__).resolve().parents[2]
PAGE, PICTURE = ROOT / "docs" / "fidelity.md", ROOT / "docs" / "pictures" / "recordings.png"
TABLE = re.compile(r"(<!-- recordings: begin[^\n]*-->\n).*?(<!-- recordings: end -->)", re.DOTALL)
SCENE = "drone_scene.ttt"
CLOSED, AXIS, OWN = "closed loop", "recorded forces along the recorded axis", "recorded forces along its own axis"
# Commit with scene and recording, its file, and the ways to fly it: the third was made with another controller.
RECORDINGS = {
    "flight 1": ("a8b05b1", "simulation_logs.csv", (CLOSED, AXIS, OWN)),
    "flight 2": ("a8b05b1", "simulation_logs_25032025-173337.csv", (CLOSED, AXIS, OWN)),
    "flight 3 (ODE)": ("702d3d4", "simulation_logs.csv", (AXIS, OWN)),
}
SPANS = (10, 20, 50)  # s


def main() -> int:
    """Run the comparison; return the exit status."""
    parser = argparse.ArgumentParser(prog="./dev.sh recordings", description=__doc__)
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="clone of OBulun/Coppelia-Quad")
    parser.add_argument("--docs", action="store_true", help="write table and plot into docs/")
    options = parser.parse_args()
    try:
        compared = {key: flown for name in RECORDINGS for key, flown in compare(options.folder, name)}
    except OSError as error:
        print(f"{options.folder}: {error}", file=sys.stderr)
        return 2
    lines = table(compared)
    print("\n".join(lines))
    if options.docs:
        text = PAGE.read_text(encoding="utf-8")
        PAGE.write_text(TABLE.sub(lambda match: match[1] + "\n".join(lines) + "\n" + match[2], text), encoding="utf-8")
        plot(compared, PICTURE)
    return 0


def unpack(clone: Path, commit: str, folder: Path) -> None:
    """Extract the files of a commit into a folder. Raises OSError."""
    archive = subprocess.run(["git", "-C", clone, "archive", commit], capture_output=True, check=False)
    if archive.returncode:
        raise OSError(f"no clone with the commit {commit} of OBulun/Coppelia-Quad")
    subprocess.run(["tar", "-x", "-C", folder], input=archive.stdout, check=True)


def compare(clone: Path, name: str):
    """Yield ((name, way), (recording, flown states)) for each way to fly a recording."""
    commit, file, ways = RECORDINGS[name]
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        unpack(clone, commit, folder)
        recording = flights.read(folder / file)
        choices = {
            CLOSED: lambda: flights.closed_loop(folder, recording),
            AXIS: lambda: flights.recorded_attitude(recording),
            OWN: lambda: flights.open_loop(recording),
        }
        with flights.simulation(folder / SCENE) as sim:
            for way in ways:
                print(f"  {name}, {way}", file=sys.stderr, flush=True)
                yield (name, way), (recording, flights.fly(sim, recording, choices[way]()))


def errors(recording: flights.Recording, states: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the error of each step: distance (mm), and roll, pitch, yaw (degrees)."""
    gap = np.linalg.norm(states[:, :3] - recording.states[:, :3], axis=1) * 1e3
    turned = (states[:, 6:9] - recording.states[:, 6:9] + np.pi) % (2 * np.pi) - np.pi
    return gap, np.degrees(np.abs(turned))


def table(compared) -> list[str]:
    """Return the rows of a Markdown table: the largest errors within each of SPANS."""
    spans = " | ".join(f"{span} s" for span in SPANS)
    lines = [f"| | position, until {spans} | roll, pitch, yaw in all |", "|---|" + "---|" * (len(SPANS) + 1)]
    for (name, way), (recording, states) in compared.items():
        gap, turned = errors(recording, states)
        duration = recording.times[-1]
        within = " | ".join(length(gap[recording.times <= one].max()) if one < duration + 0.2 else "" for one in SPANS)
        angles = ", ".join(f"{rounded(angle)}°" for angle in turned.max(axis=0))
        lines.append(f"| {name}, {way} | {within} | {angles} |")
    return lines


def length(millimetres: float) -> str:
    """Return a length as text, in mm or m."""
    return f"{rounded(millimetres)} mm" if millimetres < 100 else f"{rounded(millimetres / 1e3)} m"


def rounded(number: float) -> str:
    """Return a number with two digits, or as many as it has before the point."""
    return f"{number:.2g}" if number < 100 else f"{number:.0f}"


def plot(compared, path: Path) -> None:
    """Plot the closed-loop flights, recorded and simulated, and the distance between them."""
    drawn = [name for name, way in compared if way == CLOSED]
    figure, axes = plt.subplots(3, len(drawn), figsize=(11, 8), sharex=True, layout="constrained")
    for column, name in zip(axes.T, drawn):
        recording, states = compared[name, CLOSED]
        for index, axis in enumerate("xyz"):
            (line,) = column[0].plot(recording.times, recording.states[:, index], lw=3, alpha=0.35)
            column[0].plot(recording.times, states[:, index], lw=1, color=line.get_color(), label=axis)
        gap, turned = errors(recording, states)
        column[1].plot(recording.times, gap)
        column[2].plot(recording.times, turned, label=["roll", "pitch", "yaw"])
        column[0].set_title(f"{name}: wide CoppeliaSim 4.9, narrow drone_sim")
        column[2].set_xlabel("time [s]")
        column[0].legend(), column[2].legend()
    for axis, label in zip(axes[:, 0], ("position [m]", "distance [mm]", "error of angles [°]")):
        axis.set_ylabel(label)
    figure.savefig(path, dpi=100)


if __name__ == "__main__":
    sys.exit(main())
