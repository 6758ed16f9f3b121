"""The program that forks a process for each script: in the sandbox, where there is one.

It knows no plan, no seed, and no judge: its only connection is a door from a script's process to the process of its
flight.
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
from typing import Any

import numpy as np

from drone_sim.files.containment import remove
from drone_sim.grading.jobs import system_calls
from drone_sim.grading.jobs.limited_process import LimitedProcess, open_to_itself
from drone_sim.grading.jobs.server import GONE, HANDED_IN, HUNG_UP, Requests
from drone_sim.scripting.rpc import script_process
from drone_sim.scripting.rpc.script_process import ScriptWorker

DOOR = 3  # its descriptor, beside which nothing is open


def main() -> None:
    """Serve: each request names a script, and files to be laid down for it; how its process ended goes back.

    A message ends the process, whatever it does; HUNG_UP says that it has closed its door, and may be ending already.
    """
    is_alone = sys.argv[1:] == ["alone"]  # in a sandbox, where it sees its own processes only
    worker = script_process.prepared()
    try:
        system_calls.forbid()
    except OSError as error:
        print(f"grade: scripts can share memory and use a network: {error.strerror}", file=sys.stderr)
    requests = Requests()
    folders = [os.environ["TMPDIR"], *([HANDED_IN] if is_alone else [])]
    with contextlib.suppress(*GONE):
        for request, door in requests:
            for path in request["handed_in"]:
                _lay(f"{HANDED_IN}{path}", requests.receive())
            run = functools.partial(_run, worker, request, door)
            process = LimitedProcess(request["limits"], run, {}, [door.fileno()], folders if is_alone else ())
            door.close()
            end = _end_of(process, requests)
            is_last = not all([_cleared(folder) for folder in folders])  # what cannot be removed here, its client does
            requests.reply(json.dumps({"end": end, "is_last": is_last}).encode())
            if is_last:
                break


def _end_of(process: LimitedProcess, requests: Requests) -> str:
    """Watch a flight's process until it has ended, or is not needed any more; return how it ended, or ''."""
    with process:
        is_over = process.watch(requests.fileno())
        has_ended = is_over or (requests.receive() == HUNG_UP and process.ends())
    if is_over:
        requests.receive()
    return process.end if has_ended else ""


def _run(worker: ScriptWorker, request: dict[str, Any], door: socket.socket, _outputs: Mapping[str, int]) -> None:
    """Serve the script's end of the door, in a process of its own."""
    given = door.detach()
    if given != DOOR:
        os.dup2(given, DOOR, inheritable=False)
        os.close(given)
    open_to_itself()
    random.seed(request["random"])
    np.random.seed(request["random"] % 2**32)
    script_process.serve(worker, socket.socket(fileno=DOOR), request["script"])


def _lay(path: str, content: bytes) -> None:
    """Write a file of the script that is to be flown."""
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "wb") as file:
        file.write(content)


def _cleared(folder: str) -> bool:
    """Remove what a flight has left in a folder; return whether nothing is there any more."""
    os.chmod(folder, stat.S_IRWXU)
    for entry in os.scandir(folder):
        with contextlib.suppress(OSError, RecursionError):
            remove(entry.path, within=folder)
    return not os.listdir(folder)


if __name__ == "__main__":
    main()
