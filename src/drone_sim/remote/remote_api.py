"""Both remote APIs together, through which external programs control the simulation, if they are enabled."""

from __future__ import annotations

from typing import TYPE_CHECKING

from drone_sim.remote.conversation import RemoteApi, Watched, unwatched
from drone_sim.run.parameters import RemoteApiParameters
from drone_sim.run.player import Player
from drone_sim.scripting.api.backend import Backend

if TYPE_CHECKING:
    from drone_sim.remote.legacy.server import LegacyServer
    from drone_sim.remote.server import RemoteApiServer


def start_server(
    parameters: RemoteApiParameters, player: Player, backend: Backend | None = None, watched: Watched = unwatched
) -> RemoteApi:
    """Listen for clients that control `player`; return the servers (RemoteApiServers), or none if disabled.

    `backend` transports the ROS messages of ZeroMQ clients; `watched` returns the function to call in place of a named
    function. Raises OSError, in one line.
    """
    if not parameters.serve:
        return RemoteApi()
    try:
        from drone_sim.remote.legacy.server import LegacyServer
        from drone_sim.remote.server import RemoteApiServer  # needs pyzmq and cbor2
    except ImportError as error:
        raise OSError(f"the remote API needs pyzmq and cbor2 (pip install pyzmq cbor2): {error}") from None
    zeromq = RemoteApiServer(player, parameters.address, parameters.port, backend, watched=watched)
    try:
        legacy = LegacyServer(
            player, parameters.address, parameters.legacy_port, zeromq.moved, zeromq.everybody, watched=watched
        )
    except OSError:
        zeromq.close()
        raise
    return RemoteApiServers(zeromq, legacy)


class RemoteApiServers(RemoteApi):
    """CoppeliaSim's API over ZeroMQ and V-REP's legacy one, for the simulation's thread only.

    `wake` alone is thread-safe.
    """

    def __init__(self, zeromq: RemoteApiServer, legacy: LegacyServer):
        self.zeromq, self.legacy = zeromq, legacy
        self.address = f"{zeromq.address} (ZeroMQ) and on {legacy.address} (simxStart)"
        zeromq.watch(legacy.fileno())

    @property
    def holds(self) -> bool:
        return self.zeromq.holds or self.legacy.holds

    def wait(self, seconds: float) -> None:
        self.zeromq.wait(0.0 if self.legacy.has_work else seconds)
        self.legacy.serve()

    def serve(self) -> None:
        self.zeromq.serve()
        self.legacy.serve()

    def wake(self) -> None:
        self.zeromq.wake()

    def close(self) -> None:
        self.legacy.close()
        self.zeromq.close()
