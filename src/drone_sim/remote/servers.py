"""Both remote APIs together: CoppeliaSim's over ZeroMQ, and V-REP's legacy one."""

from __future__ import annotations

from drone_sim.remote.control import MovedObjects
from drone_sim.remote.conversation import RemoteApi, Watched, unwatched
from drone_sim.remote.legacy.server import LegacyServer
from drone_sim.remote.server import RemoteApiServer
from drone_sim.run.parameters import RemoteApiParameters
from drone_sim.run.player import Player
from drone_sim.scripting.api.backend import Backend


class RemoteApiServers(RemoteApi):
    """Both servers, for the simulation's thread only; `wake` alone is thread-safe."""

    def __init__(
        self,
        parameters: RemoteApiParameters,
        player: Player,
        backend: Backend | None = None,
        watched: Watched = unwatched,
    ):
        """Listen for clients that control `player`; `backend` transports the ROS messages of ZeroMQ clients.

        `watched` returns the function to call in place of a named function. Raises OSError, in one line.
        """
        moved, address = MovedObjects(player.simulation), parameters.address
        self.zeromq = RemoteApiServer(player, address, parameters.port, backend, moved=moved, watched=watched)
        try:
            self.legacy = LegacyServer(
                player, address, parameters.legacy_port, moved, self.zeromq.everybody, watched=watched
            )
        except OSError:
            self.zeromq.close()
            raise
        self.address = f"{self.zeromq.address} (ZeroMQ) and on {self.legacy.address} (simxStart)"
        self.zeromq.watch(self.legacy.fileno())

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
