"""Worker process that receives cases from a pipe until it is closed, and tries them within a memory limit.

`python worker.py DESCRIPTOR`: the file descriptor of a multiprocessing connection.
"""

from __future__ import annotations

import faulthandler
import gc
import os
import resource
import shutil
import sys
import tempfile
import threading
import time
import traceback
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from case import Answer

MEMORY = 4 << 30  # bytes of address space; Python and Mesa use some 1.5 GiB before any case


def _resident() -> int:
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def _innermost_function(error: BaseException) -> str:
    """Return the innermost function of drone_sim, which distinguishes faults with the same message."""
    frames = [f for f in traceback.extract_tb(error.__traceback__) if "drone_sim" in f.filename]
    last = frames[-1] if frames else None
    return f"{Path(last.filename).name}:{last.name}" if last else "?"


def _try(case: Any, background: list[str]) -> Answer:
    from trials import Fault, prepare, run

    folder = Path(tempfile.mkdtemp(prefix="fuzz"))
    prepare(case)
    start = time.process_time()  # processor time, since other processes may be busy, too
    fault = refusal = ""
    try:
        refusal = run(case, folder)
    except Fault as error:
        fault = str(error)
    except BaseException as error:  # every other exception is a fault
        trace = "".join(traceback.format_tb(error.__traceback__))
        fault = f"{type(error).__name__} in {_innermost_function(error)}: {_message_of(error)}\n{trace}"
    seconds = time.process_time() - start
    shutil.rmtree(folder, ignore_errors=True)
    gc.collect()
    if background and not fault:
        fault = "in the background: " + background[0]
    background.clear()
    return Answer(fault, refusal, seconds, _resident(), _busy())


def _busy() -> bool:
    """Return whether a thread that the case started is still busy."""
    start = time.process_time()
    if len(os.listdir("/proc/self/task")) > 1:
        time.sleep(0.02)
    return time.process_time() - start > 0.01


def _message_of(error: BaseException) -> str:
    try:
        return str(error)[:300]
    except Exception:
        return "(its __str__ raises)"


def main() -> None:
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    faulthandler.enable()
    background: list[str] = []
    threading.excepthook = lambda hook: background.append(f"{hook.exc_type.__name__}: {_message_of(hook.exc_value)}")
    connection = Connection(int(sys.argv[1]))
    while True:
        try:
            case = connection.recv()
        except EOFError:
            return
        connection.send(_try(case, background))


if __name__ == "__main__":
    main()
