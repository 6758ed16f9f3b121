"""Whether anybody outside may drive the simulation: the server where it is on, nobody where it is off."""

from __future__ import annotations

import time
from typing import Protocol

from drone_sim.run.parameters import RemoteApiParameters
from drone_sim.run.player import Player
from drone_sim.scripting.api.backend import Backend


class Outside(Protocol):
    """Who else has a say in when the simulation steps, and is to be heard meanwhile."""

    address: str

    @property
    def holds(self) -> bool:
        """Whether the next step has to wait."""

    def wait(self, seconds: float) -> None:
        """Sleep for so long, or until somebody has been heard."""

    def serve(self) -> None:
        """Hear whoever has come by now."""

    def wake(self) -> None:
        """End a `wait`; any thread may call it."""

    def close(self) -> None:
        """Let go of everybody."""


class Nobody:
    """Nobody outside."""

    address = ""
    holds = False
    wait = staticmethod(time.sleep)

    def serve(self) -> None:
        """Do nothing."""

    wake = close = serve


def let_in(parameters: RemoteApiParameters, player: Player, backend: Backend | None = None) -> Outside:
    """Return who is outside. Raises OSError where nobody can be heard, in one line."""
    if not parameters.serve:
        return Nobody()
    try:
        from drone_sim.remote.server import Server  # whoever serves nobody needs neither pyzmq nor cbor2
    except ImportError as error:
        raise OSError(f"the remote API needs pyzmq and cbor2 (pip install pyzmq cbor2): {error}") from None
    return Server(player, parameters.address, parameters.port, backend)
