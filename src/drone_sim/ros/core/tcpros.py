"""Connections to a node, for topics and for services: any number at the same time, and none waits for another.

In rospy only five callers can wait to be accepted; TCP makes later ones try again after 1, 3 and 7 s. And one thread
accepts the callers and reads from them one after the other: a caller that sends nothing, or hangs, blocks all others
for good.
"""

from __future__ import annotations

import contextlib
import socket
import threading
from collections.abc import Callable
from typing import Any

from rospy.impl import tcpros_base

_WAITING = 128  # connections that may wait, as many as rospy's XML-RPC server allows
_SAYS = 10.0  # s, until a connection must have said something

_Inbound = Callable[[socket.socket, Any], None]


def take_connections() -> None:
    """Let each connection of this node be taken in a thread of its own; to be called once, after rospy.init_node."""
    tcpros_base.start_tcpros_server()
    server = tcpros_base._tcpros_server.tcp_ros_server  # rospy has no other way to either
    server.server_sock.listen(_WAITING)
    server.inbound_handler = _in_a_thread(server.inbound_handler)


def _in_a_thread(inbound: _Inbound) -> _Inbound:
    def heard(connection: socket.socket, address: Any) -> None:
        with contextlib.suppress(OSError):
            connection.settimeout(_SAYS)
            connection.recv(1, socket.MSG_PEEK)
            connection.settimeout(None)
            # Without it a small message waits until the last one has been acknowledged, for up to 40 ms.
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            return inbound(connection, address)
        connection.close()
        return None

    def take(connection: socket.socket, address: Any) -> None:
        threading.Thread(target=heard, args=(connection, address), daemon=True).start()

    return take
