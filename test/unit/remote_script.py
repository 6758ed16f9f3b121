"""Flies a script in a process of its own, behind a door, for the tests; without limits and without a sandbox."""

import contextlib
import os
import random
import signal
import socket

import numpy as np

from drone_sim.grading.flight import Flight, script_seed
from drone_sim.scripting.rpc import script_process
from drone_sim.scripting.rpc.connection import ScriptConnection


@contextlib.contextmanager
def process_of(serve):
    """Give the end of a connection whose other end a process has, which calls `serve` with it."""
    here, there = socket.socketpair()
    process = os.fork()
    if not process:
        try:
            here.close()
            serve(there)
        finally:
            os._exit(0)
    there.close()
    try:
        yield here
    finally:
        here.close()
        os.kill(process, signal.SIGKILL)
        os.waitpid(process, 0)


def flown(plan, script, seed=0, serve=None):
    """Return the result of a flight whose script is elsewhere, and whether its door was closed by then."""

    def serve_script(end):
        random.seed(script_seed(seed))
        np.random.seed(script_seed(seed) % 2**32)
        script_process.serve(script_process.ScriptWorker(), end, script)

    with process_of(serve or serve_script) as end:
        door = ScriptConnection(end)
        result = Flight(plan, script, seed, {}, door).grade()
        return result, door.why_closed
