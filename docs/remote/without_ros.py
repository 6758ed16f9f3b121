#!/usr/bin/env python3
"""The flight of fly_outside.py without ROS: the simulation in a thread of this process, as fast as it can."""

import queue
import sys
import threading

import fly_outside

from drone_sim.remote.standalone import play
from drone_sim.run import parameters

VALUES = {"script": "target", "real_time_factor": 0, "remote_api": {"port": 0}}  # 0: a port that is free


def main(arguments=None):
    """Fly, plot; return both paths."""
    ports, over = queue.Queue(), threading.Event()
    work = (parameters.load(VALUES), over.is_set, lambda server: ports.put(server.port))
    simulator = threading.Thread(target=play, args=work)
    simulator.start()
    try:
        given = sys.argv[1:] if arguments is None else arguments
        return fly_outside.main(["--port", str(ports.get(timeout=60)), *given])
    finally:
        over.set()
        simulator.join()


if __name__ == "__main__":
    main()
