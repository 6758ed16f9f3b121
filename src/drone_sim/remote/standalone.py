"""A simulation that clients drive, without ROS."""

from __future__ import annotations

from collections.abc import Callable

from drone_sim.remote.server import Server
from drone_sim.run.pace import period
from drone_sim.run.pacing import Pacer
from drone_sim.run.parameters import Parameters
from drone_sim.run.player import Player
from drone_sim.run.simulation import Simulation

_LOOK = 0.1  # s between two looks whether it is over


def play(parameters: Parameters, over: Callable[[], bool], listening: Callable[[Server], None]) -> None:
    """Wait for clients, and step as they say, at the parameters' pace, until it is over.

    `listening` is called once, before that. Raises what Simulation raises, and OSError where nobody can be heard.
    """
    simulation = Simulation(parameters, started=False)
    try:
        player = Player(simulation, simulation.step, lambda _state: None, simulated_time=False)
        server = Server(player, parameters.remote_api.address, parameters.remote_api.port)
        try:
            listening(server)
            _play(player, server, over)
        finally:
            server.close()
    finally:
        simulation.close()


def _play(player: Player, server: Server, over: Callable[[], bool]) -> None:
    pacer = Pacer(period(player.simulation.parameters), sleep=server.wait)
    while not over():
        if player.playing and not server.holds:
            pacer.wait(over)
            server.serve()
            if player.playing and not server.holds:
                player.step()
        else:
            server.wait(_LOOK)
            pacer.excuse()
