"""Start of the remote API servers, through which external programs control the simulation, if they are enabled."""

from __future__ import annotations

from drone_sim.remote.conversation import RemoteApi, Watched, unwatched
from drone_sim.run.parameters import RemoteApiParameters
from drone_sim.run.player import Player
from drone_sim.scripting.api.backend import Backend


def start_server(
    parameters: RemoteApiParameters, player: Player, backend: Backend | None = None, watched: Watched = unwatched
) -> RemoteApi:
    """Return the servers (RemoteApiServers), or none if disabled. Raises OSError, in one line."""
    if not parameters.serve:
        return RemoteApi()
    try:
        from drone_sim.remote.servers import RemoteApiServers  # needs pyzmq and cbor2
    except ImportError as error:
        raise OSError(f"the remote API needs pyzmq and cbor2 (pip install pyzmq cbor2): {error}") from None
    return RemoteApiServers(parameters, player, backend, watched)
