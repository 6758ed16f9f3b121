"""A simulation controlled by remote clients, without ROS."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing

from drone_sim.remote.server import RemoteApiServer
from drone_sim.run.pacing import Pacer, period
from drone_sim.run.parameters import Parameters
from drone_sim.run.player import Player
from drone_sim.run.simulation import Simulation

_CHECK_INTERVAL = 0.1  # s between calls of `over`


def play(parameters: Parameters, over: Callable[[], bool], listening: Callable[[RemoteApiServer], None]) -> None:
    """Run a simulation that clients start and step, at the parameters' pace, until `over` returns true.

    `listening` is called once clients can connect. Raises what Simulation raises, and OSError if it cannot listen.
    """
    remote_api = parameters.remote_api
    with closing(Simulation(parameters, started=False)) as simulation:
        player = Player(simulation, lambda _state: None, simulated_time=False)
        with closing(RemoteApiServer(player, remote_api.address, remote_api.port)) as server:
            listening(server)
            pacer = Pacer(period(parameters), sleep=server.wait)
            while not over():
                if player.playing and not server.holds:
                    pacer.wait(over)
                    server.serve()
                    if player.playing and not server.holds:
                        player.step()
                else:
                    server.wait(_CHECK_INTERVAL)
                    pacer.excuse()
