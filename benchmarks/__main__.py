"""`./dev.sh bench [NAME...] [--plot FILE]`: measure, print tables, write benchmarks/results.json.

`./dev.sh bench --against REVISION`: compare the loop with that of another revision, and write nothing.
"""

import argparse
import json
import platform
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from benchmarks import against, plot
from benchmarks.named import BENCHMARKS, Row, measured
from drone_sim.files import writing
from drone_sim.render.renderer import Renderer

PAGE = Path(__file__).parents[1] / "docs/benchmarks.md"
RESULTS = Path(__file__).parent / "results.json"


def machine() -> str:
    """Name the processor, and what draws."""
    renderer = Renderer()
    drawn_by = renderer.description
    renderer.close()
    names = [line.partition(": ")[2] for line in Path("/proc/cpuinfo").read_text().splitlines() if "model name" in line]
    return f"{(names or [platform.machine()])[0]}, {len(names)} cores; OpenGL by {drawn_by}"


def table(rows: list[Row]) -> str:
    """Lay rows out in columns; a number gets three digits."""
    keys = [*dict.fromkeys(key for row in rows for key in row)]
    cells = [keys] + [[_text(row.get(key, "")) for key in keys] for row in rows]
    widths = [max(map(len, column)) for column in zip(*cells)]
    return "\n".join("  ".join(cell.ljust(width) for cell, width in zip(line, widths)).rstrip() for line in cells)


def _text(value: Any) -> str:
    if not isinstance(value, float):
        return str(value)
    return f"{value:.3g}" if value < 1000 else str(round(value))


def _fill_page(results: dict[str, Any]) -> None:
    begin, end = "<!-- benchmarks: begin -->\n", "<!-- benchmarks: end -->"
    tables = [f"{name}\n{table(results[name])}" for name in BENCHMARKS if name in results]
    block = "```text\n" + "\n\n".join([f"on {results['machine']}", *tables]) + "\n```\n"
    before, _, rest = PAGE.read_text().partition(begin)
    writing.write(PAGE, before + begin + block + end + rest.partition(end)[2])


def main() -> int:
    """Run the benchmarks named, or all."""
    parser = argparse.ArgumentParser(prog="./dev.sh bench", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"one of {', '.join(BENCHMARKS)}; all without")
    parser.add_argument("--docs", action="store_true", help="put the tables into docs/benchmarks.md")
    parser.add_argument("--plot", metavar="FILE", help="draw the results to a picture")
    parser.add_argument("--against", metavar="REVISION", help="compare the loop with that of a git revision, in turns")
    arguments = parser.parse_args()
    if arguments.against:
        try:
            print(table(against.compare(arguments.against)))
        except subprocess.CalledProcessError:
            parser.error(f"--against {arguments.against}: git knows no such revision")
        return 0
    unknown = set(arguments.names) - set(BENCHMARKS)
    if unknown:
        parser.error(f"no benchmark {', '.join(sorted(unknown))}; there are {', '.join(BENCHMARKS)}")
    results = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    results["machine"] = machine()
    print(f"on {results['machine']}\n")
    for name in arguments.names or BENCHMARKS:
        print(f"measuring: {name} ...", file=sys.stderr, flush=True)
        with ProcessPoolExecutor(1, get_context("spawn")) as process:  # a process can be a ROS node but once
            results[name] = process.submit(measured, name).result()
        print(f"{name}\n{table(results[name])}\n", flush=True)
        writing.write(RESULTS, json.dumps(results, indent=1) + "\n")
    if arguments.plot:
        plot.draw(results, arguments.plot)
    if arguments.docs:
        _fill_page(results)
    return 0


if __name__ == "__main__":
    sys.exit(main())
