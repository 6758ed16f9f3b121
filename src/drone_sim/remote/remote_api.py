"""Start of the remote API servers, through which programs outside control the simulation, if they are switched on."""

from __future__ import annotations

from drone_sim.remote.conversation import RemoteApi, Watched, unwatched
from drone_sim.run.parameters import RemoteApiParameters
from drone_sim.run.player import Player
from drone_sim.scripting.api.backend import Backend


def start_server(
    parameters: RemoteApiParameters, player: Player, backend: Backend | None = None, watched: Watched = unwatched
) -> RemoteApi:
    """Return the servers, see RemoteApiServers; without any if switched off. Raises OSError, in one line."""
    if not parameters.serve:
        return RemoteApi()
    try:
        from drone_sim.remote.servers import RemoteApiServers  # whoever serves nobody needs neither pyzmq nor cbor2
    except ImportError as error:
        raise OSError(f"the remote API needs pyzmq and cbor2 (pip install pyzmq cbor2): {error}") from None
    return RemoteApiServers(parameters, player, backend, watched)
