"""What the programs share: every mistake of a user is reported in one line, whatever part of the code finds it."""

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
EXPECTED = (ScriptError, OSError, ValueError, RuntimeError)  # their messages are one line for the user
# What single commands import, and only when they are asked for it: `./dev.sh setup` leaves it out.
SEPARATE = ("av", "distributed", "jinja2", "matplotlib", "scipy")


class Parser(argparse.ArgumentParser):
    """An argument parser that says what is wrong in one line, instead of the usage; `--seed` is not `--seeds`."""

    wrong = FAILED  # the exit status for wrong arguments

    def __init__(self, **options: Any):
        """Take what argparse's own takes; options are not abbreviated."""
        super().__init__(allow_abbrev=False, **options)

    def error(self, message: str) -> NoReturn:
        """End the program, with that line on stderr."""
        self.exit(self.wrong, f"{self.prog}: {' '.join(message.split())} (see {self.prog} --help)\n")


def status_of(
    program: str,
    action: Callable[[], int | None],
    wrong: int = FAILED,
    passed_on: type[Exception] | tuple[()] = (),
) -> int:
    """Return the exit status of an action, 0 for None; 130 after Ctrl-C; `wrong` after a line for a user's mistake.

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
        said = f"this needs the Python package {package}: {installation_of(package)}"
    except EXPECTED as error:
        said = printable(format_error(error))
    print(f"{program}: {said}", file=sys.stderr, flush=True)
    return wrong


def installation_of(separate: str) -> str:
    """Return how a package of SEPARATE is installed, in words."""
    if (package_path() / "dev.sh").is_file():
        return "`./dev.sh setup --all` installs it"
    return f"`apt install python3-{separate}` installs it"


def format_error(error: BaseException) -> str:
    """Return what is wrong, in one line; of an OSError its file, too."""
    said = str(error)
    if isinstance(error, OSError) and error.filename is not None:
        said = f"{error.filename}: {error.strerror}"
    return " ".join(said.split())
