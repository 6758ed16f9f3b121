"""A simulation that clients drive, without ROS."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing

from drone_sim.remote.server import RemoteApiServer
from drone_sim.run.pacing import Pacer, period
from drone_sim.run.parameters import Parameters
from drone_sim.run.player import Player
from drone_sim.run.simulation import Simulation

_LOOK = 0.1  # s between two looks whether it is over


def play(parameters: Parameters, over: Callable[[], bool], listening: Callable[[RemoteApiServer], None]) -> None:
    """Wait for clients, and step as they say, at the parameters' pace, until it is over.

    `listening` is called once, before that. Raises what Simulation raises, and OSError where nobody can be heard.
    """
    remote_api = parameters.remote_api
    with closing(Simulation(parameters, started=False)) as simulation:
        player = Player(simulation, simulation.step, lambda _state: None, simulated_time=False)
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
                    server.wait(_LOOK)
                    pacer.excuse()
