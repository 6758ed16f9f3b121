#!/usr/bin/env python3
"""`./dev.sh fuzz [CASES] [--seed N]`: try odd input against the real code, in processes that may die.

A case passes if it is taken, or refused with one line, within 3 s of the processor and the limit of memory. Any other
end is a fault: hypothesis makes it smaller, prints it with what happened, and tries it first in the next run. Exit
status 1 where there was any.
"""

import argparse
import os
import sys
from pathlib import Path

import pytest
from test_fuzz import KINDS

HERE = Path(__file__).parent


def main():
    parser = argparse.ArgumentParser(
        prog="./dev.sh fuzz", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("cases", nargs="?", type=int, default=1000, help="how many, over all kinds (default: 1000)")
    parser.add_argument("--seed", type=int, default=0, help="the same seed tries the same cases (default: 0)")
    parser.add_argument(
        "--kinds", nargs="+", choices=KINDS, default=KINDS, metavar="KIND", help=f"of {', '.join(KINDS)}"
    )
    parser.add_argument("--jobs", type=int, default=2, help="processes at a time (default: 2)")
    options = parser.parse_args()
    os.environ["DRONE_SIM_FUZZ_CASES"] = str(-(-options.cases // len(options.kinds)))
    os.environ["DRONE_SIM_FUZZ_SEED"] = str(options.seed)
    tests = [
        f"{HERE / 'test_fuzz.py'}::test_odd_input_is_taken_or_refused_in_one_line[{kind}]" for kind in options.kinds
    ]
    return pytest.main([*tests, "-rP", f"--numprocesses={options.jobs}"])


if __name__ == "__main__":
    sys.exit(main())
