"""A program that forks a process for each script; it runs in the sandbox if there is one.

It has neither plan nor seed: a script's process has one connection, to the judge's process of the flight.
"""

from __future__ import annotations

import contextlib
import functools
import json
import os
import random
import socket
import stat
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from drone_sim.files.containment import remove
from drone_sim.grading.jobs import system_calls
from drone_sim.grading.jobs.limited_process import LimitedProcess, drop_capabilities
from drone_sim.grading.jobs.server import DISCONNECTED, HANDED_IN, HUNG_UP, Requests
from drone_sim.scripting.rpc import script_process
from drone_sim.scripting.rpc.script_process import ScriptWorker

_LINK = 3  # the only open descriptor of a script's process besides the standard streams


def main() -> None:
    """Answer each request, which names a script and its files, with a message about how the script's process ended.

    The next message of the client ends the process; HUNG_UP means that the process has closed its socket, and may be
    ending already.
    """
    is_alone = sys.argv[1:] == ["alone"]  # in a sandbox, which shows only the sandbox's own processes
    worker = script_process.prepared()
    try:
        system_calls.forbid()
    except OSError as error:
        print(f"grade: scripts can share memory and use a network: {error.strerror}", file=sys.stderr)
    requests = Requests()
    folders = [os.environ["TMPDIR"], *([HANDED_IN] if is_alone else [])]
    with contextlib.suppress(*DISCONNECTED):
        for request, link in requests:
            for path in request["handed_in"]:
                file = Path(f"{HANDED_IN}{path}")
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_bytes(requests.receive())
            run = functools.partial(_run, worker, request, link)
            process = LimitedProcess(request["limits"], run, {}, [link.fileno()], folders if is_alone else ())
            link.close()
            end = _watch(process, requests)
            is_last = not all([_clear(folder) for folder in folders])  # the client removes what is left
            requests.reply(json.dumps({"end": end, "is_last": is_last}).encode())
            if is_last:
                break


def _watch(process: LimitedProcess, requests: Requests) -> str:
    """Watch a script's process until it ends, or the client's next message; return how it ended by itself, or ''."""
    with process:
        is_over = process.watch(requests.fileno())
        has_ended = is_over or (requests.receive() == HUNG_UP and process.wait_for_exit())
    if is_over:
        requests.receive()
    return process.end if has_ended else ""


def _run(worker: ScriptWorker, request: dict[str, Any], link: socket.socket, _outputs: Mapping[str, int]) -> None:
    """Serve the script's end of the link, in the forked process."""
    descriptor = link.detach()
    if descriptor != _LINK:
        os.dup2(descriptor, _LINK, inheritable=False)
        os.close(descriptor)
    drop_capabilities()
    random.seed(request["random"])
    np.random.seed(request["random"] % 2**32)
    script_process.serve(worker, socket.socket(fileno=_LINK), request["script"])


def _clear(folder: str) -> bool:
    """Remove the content of a folder; return whether it is empty."""
    os.chmod(folder, stat.S_IRWXU)
    for entry in os.scandir(folder):
        with contextlib.suppress(OSError, RecursionError):
            remove(entry.path, within=folder)
    return not os.listdir(folder)


if __name__ == "__main__":
    main()
