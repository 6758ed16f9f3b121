"""Print some columns of a flight's CSV at some times.

python3 docs/tutorial/values.py flight.csv z vz --at 1 5 10
"""

import argparse
import csv
import sys


def main(arguments=None):
    """Print a line for each time; return the exit status."""
    options = _parser().parse_args(arguments)
    try:
        with open(options.csv, newline="", encoding="utf-8") as file:
            header, *rows = csv.reader(file)
    except (OSError, ValueError) as error:
        return _fail(f"{options.csv}: {error}")
    names = [title.split()[0] for title in header]
    unknown = [name for name in options.columns if name not in names]
    if unknown or not rows:
        return _fail(f"{options.csv}: no column {', '.join(unknown)}; it has {', '.join(names)}")
    columns = [names.index(name) for name in ("t", *options.columns)]
    table = [[float(row[column]) for column in columns] for row in rows]
    widths = [max(10, len(header[column])) for column in columns]
    print("  ".join(f"{header[column]:>{width}}" for column, width in zip(columns, widths)))
    for time in options.at:
        nearest = min(table, key=lambda row: abs(row[0] - time))
        # + 0.0 makes a 0 of -0
        print("  ".join(f"{round(value, 3) + 0.0:{width}.3f}" for value, width in zip(nearest, widths)))
    return 0


def _fail(message):
    print(f"values.py: {message}", file=sys.stderr)
    return 1


def _parser():
    parser = argparse.ArgumentParser(description="Print columns of a flight's CSV at some times.")
    parser.add_argument("csv", help="what `fly --csv` wrote")
    parser.add_argument("columns", nargs="+", help="such as z vz wz propeller1")
    parser.add_argument("--at", nargs="+", type=float, required=True, metavar="S", help="times in seconds")
    return parser


if __name__ == "__main__":
    sys.exit(main())
