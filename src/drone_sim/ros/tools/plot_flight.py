"""Draw a flight from a bag, or from a table of `fly --csv`: commands and flown values, path, attitude, sensors."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path

from drone_sim.command_line import Parser, status_of
from drone_sim.message_text import shown
from drone_sim.offline.recording import read_table
from drone_sim.offline.timeline import Timeline

_NAME = "plot_flight"
_TABLES, _BAG = (".csv", ".txt"), ".bag"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return 0, or 1 after a line on stderr for a file that cannot be read or written."""
    parser = Parser(prog=_NAME, description=__doc__)
    parser.add_argument("flight", metavar="FLIGHT", help="the recording: a .bag, or a .csv of fly")
    parser.add_argument(
        "plot", metavar="OUT.png", nargs="?", help="the plot (default: the name of FLIGHT, in this folder)"
    )
    parser.add_argument("--vehicle", metavar="NAME", help="which of several vehicles in a bag (default: the first)")
    options = parser.parse_args(arguments)
    return status_of(_NAME, lambda: _plot(options))


def _plot(options: argparse.Namespace) -> None:
    flight = Path(options.flight)
    ending = flight.suffix.lower()
    if ending not in (*_TABLES, _BAG):
        raise ValueError(f"{shown(options.flight)}: must end in {', '.join(_TABLES)} or {_BAG}")
    if options.vehicle is not None and ending != _BAG:
        raise ValueError(
            f"--vehicle {shown(options.vehicle)}: only works with a bag, because a table holds one vehicle"
        )
    from drone_sim.offline import plot  # slow import: matplotlib

    out = options.plot or f"{flight.stem}.png"
    plot.check(out)
    if ending != _BAG:
        plot.save(out, read_table(options.flight), Timeline((), 1.0), ())
    else:
        from drone_sim.ros.tools.bags import Bag, BagFlight  # needs ROS, which a table does not

        with closing(Bag(options.flight)) as bag:
            bag_flight = BagFlight(bag, options.vehicle)
            plot.save(out, bag_flight.recording(), bag_flight.timeline(), bag_flight.sensors())
    print(f"{_NAME}: wrote {out}", flush=True)
