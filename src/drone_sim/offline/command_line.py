"""What the programs that need no master have in common: a mistake gets one line, whoever finds it."""

from __future__ import annotations

import argparse
import signal
import sys
from collections.abc import Callable
from typing import NoReturn

FAILED, SIGNALLED = 1, 128  # exit statuses; shells add the signal's number: 130 after Ctrl-C


class Parser(argparse.ArgumentParser):
    """An argument parser that says what is wrong in one line, instead of the usage."""

    def error(self, message: str) -> NoReturn:
        """End the program, with that line on stderr."""
        self.exit(FAILED, f"{self.prog}: {' '.join(message.split())} (see {self.prog} --help)\n")


def status_of(program: str, action: Callable[[], None]) -> int:
    """Return the exit status of an action: 0, 130 after Ctrl-C, 1 after a line on stderr for a user's mistake."""
    try:
        action()
        return 0
    except OSError as error:
        said = str(error) if error.filename is None else f"{error.filename}: {error.strerror}"
    except ValueError as error:
        said = str(error)
    except KeyboardInterrupt:
        return SIGNALLED + signal.SIGINT
    print(f"{program}: {' '.join(said.split())}", file=sys.stderr, flush=True)
    return FAILED
