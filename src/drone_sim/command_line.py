"""Command-line helpers of all programs: a user's mistake is reported in one line, wherever it is detected."""

from __future__ import annotations

import argparse
import signal
import sys
from collections.abc import Callable
from typing import Any, NoReturn

from drone_sim.files.resources import package_path
from drone_sim.message_text import printable
from drone_sim.scripting.errors import ScriptError

FAILED, SIGNALLED = 1, 128  # exit statuses; shells add the signal's number: 130 after Ctrl-C
EXPECTED = (ScriptError, OSError, ValueError, RuntimeError)  # errors whose message is one line for the user
# Packages that only some commands import, when they need them; `./dev.sh setup` does not install them.
SEPARATE = ("av", "distributed", "jinja2", "matplotlib", "ompl", "scipy")


class Parser(argparse.ArgumentParser):
    """Argument parser that reports errors in one line, without the usage; options cannot be abbreviated."""

    wrong = FAILED  # the exit status for wrong arguments

    def __init__(self, **options: Any):
        """Take the options of argparse.ArgumentParser."""
        super().__init__(allow_abbrev=False, **options)

    def error(self, message: str) -> NoReturn:
        """Exit with status `wrong`, after one line on stderr."""
        self.exit(self.wrong, f"{self.prog}: {' '.join(message.split())} (see {self.prog} --help)\n")


def status_of(
    program: str,
    action: Callable[[], int | None],
    wrong: int = FAILED,
    passed_on: type[Exception] | tuple[()] = (),
) -> int:
    """Return the exit status of an action: 0 for None, 130 after Ctrl-C, `wrong` after reporting a user's mistake.

    Exceptions of the types in `passed_on` are raised again, for a caller that can say more about them.
    """
    try:
        return action() or 0
    except KeyboardInterrupt:
        return SIGNALLED + signal.SIGINT
    except passed_on:
        raise
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package not in SEPARATE:
            raise
        message = f"this needs the Python package {package}: {installation_of(package)}"
    except EXPECTED as error:
        message = printable(format_error(error))
    print(f"{program}: {message}", file=sys.stderr, flush=True)
    return wrong


def installation_of(separate: str) -> str:
    """Return a sentence on how to install a package of SEPARATE."""
    if (package_path() / "dev.sh").is_file():
        return "`./dev.sh setup --all` installs it"
    return f"`apt install python3-{separate}` installs it"


def format_error(error: BaseException) -> str:
    """Return the message of an error in one line; for an OSError with its file name."""
    message = str(error)
    if isinstance(error, OSError) and error.filename is not None:
        message = f"{error.filename}: {error.strerror}"
    return " ".join(message.split())
