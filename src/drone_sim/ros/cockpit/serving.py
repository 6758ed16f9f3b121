"""`rosrun drone_sim cockpit`: the page is served at once, and the rest is imported while a browser opens it."""

from __future__ import annotations

import asyncio
import contextlib
import io
import secrets
import sys
from collections.abc import Callable

import rospy
import viser
from websockets.asyncio.server import ServerConnection

from drone_sim.ros.cockpit.page import Found, Page
from drone_sim.ros.cockpit.server import notice
from drone_sim.ros.cockpit.server.address import free_place, urls
from drone_sim.ros.cockpit.server.gate import Gate, Handler
from drone_sim.ros.cockpit.settings import Settings, read
from drone_sim.ros.node.signals import end_on_signals
from drone_sim.ros.node.starting import init_node, reported

_NAME = "cockpit"
_SOON = 0.05  # s


class Serving:
    """The server with page, socket and scene, which are empty until `begin`."""

    def __init__(self, settings: Settings):
        """Serve. Raises AddressError where nothing can listen."""
        self._wire: Handler | None = None
        self._beside: Callable[[str], Found] = lambda _: None
        token = secrets.token_urlsafe(16)
        gate = Gate(token, Page(beside=lambda path: self._beside(path)), self._talk)
        host, port = free_place(settings.address, settings.port)
        with gate.before_viser(), contextlib.redirect_stdout(io.StringIO()):  # viser prints an address without token
            self.server = viser.ViserServer(host=host, port=port, label="drone_sim", verbose=False)
        self.port = self.server.get_port()
        self.address, self.address_elsewhere = urls(host, self.port, token)

    @property
    def told(self) -> str:
        """Where it is, for the user, with the token."""
        elsewhere = self.address_elsewhere
        return self.address + (f" and, on other machines, at {elsewhere}" if elsewhere else "")

    def begin(self, wire: Handler, beside: Callable[[str], Found]) -> None:
        """Let the browsers that are there, and those that come, talk; `beside` finds what belongs to the page."""
        self._wire, self._beside = wire, beside

    async def _talk(self, connection: ServerConnection) -> None:
        while self._wire is None:
            await asyncio.sleep(_SOON)
        await self._wire(connection)


def main() -> int:
    """Serve until the node ends; return the exit status."""
    # There may be several. Its time is the person's, who looks on while /clock stands still.
    if not init_node(_NAME, anonymous=True, disable_rostime=True, disable_signals=True):
        return 1
    end_on_signals()
    return reported(_NAME, _serve)


def _serve() -> None:
    settings = read(rospy.get_param("~", {}))
    serving = Serving(settings)
    with notice.kept(serving.address, serving.port) as where:
        notice.tell(f"the cockpit is at {serving.told}")
        rospy.loginfo(f"the cockpit listens at {serving.address.partition('?')[0]}; {where}")

        from drone_sim.ros.cockpit.cockpit import Cockpit  # which takes a second and more

        Cockpit(settings, serving).run()


if __name__ == "__main__":
    sys.exit(main())
