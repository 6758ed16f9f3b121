"""The other end of a socket: what it may tell viser, and the one line where it says something else."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Mapping
from typing import Any

import msgspec
import rospy
from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosedError
from websockets.frames import CloseCode

_SCENE = "viser-v"  # what viser's subprotocols begin with
# What viser would do for anybody who asks: lay a tunnel from a public server to this port; keep files in memory.
_REFUSED = frozenset({"ShareUrlRequest", "ShareUrlDisconnect", "FileTransferStartUpload", "FileTransferPart"})
_BROKEN = (CloseCode.PROTOCOL_ERROR, CloseCode.INVALID_DATA, CloseCode.MESSAGE_TOO_BIG)


class _Message(msgspec.Struct):
    type: str


_DECODER = msgspec.msgpack.Decoder(_Message)


class Visitor(ServerConnection):
    """A browser's socket. Whoever speaks something else than our page does is sent away with one line."""

    async def recv(self, decode: bool | None = None) -> Any:
        """Return the next message, as `ServerConnection` does."""
        try:
            message = await super().recv(decode)
        except ConnectionClosedError as error:
            if error.sent is not None and error.sent.code in _BROKEN and not error.rcvd_then_sent:
                self._say(error.sent.reason)
            raise
        wrong = _wrong(message) if str(self.subprotocol).startswith(_SCENE) else ""
        if not wrong:
            return message
        self._say(wrong)
        await self.close(CloseCode.POLICY_VIOLATION, wrong)
        return await super().recv(decode)  # which raises ConnectionClosed

    def _say(self, what: str) -> None:
        rospy.logwarn(f"a browser at {self.remote_address[0]} is sent away: {what}")


def _wrong(message: str | bytes) -> str:
    """Return what is wrong with a message to viser, '' for nothing."""
    try:
        kind = _DECODER.decode(message if isinstance(message, bytes) else b"").type
    except (msgspec.MsgspecError, RecursionError):
        return "no message of viser's"
    return f"{kind}: is not for this page" if kind in _REFUSED else ""


def logger() -> logging.Logger:
    """Return what websockets logs to: what goes wrong with a socket that is open, in one line, without a traceback."""
    made = logging.Logger("cockpit", logging.ERROR)
    made.addHandler(_OneLine())
    return made


class _OneLine(logging.Handler):
    def emit(self, record: logging.LogRecord) -> None:
        error = record.exc_info[1] if record.exc_info else None
        if record.getMessage() != "opening handshake failed":  # by whoever is no browser; there is nobody to tell
            rospy.logwarn(f"a browser's socket: {_said(error) if error else record.getMessage()}")


def failed(_loop: asyncio.AbstractEventLoop, context: Mapping[str, Any]) -> None:
    """Tell in one line what went wrong with a message that viser has taken; a loop calls it."""
    error = context.get("exception")
    rospy.logwarn(f"a browser's message: {_said(error) if error else context['message']}")


def _said(error: BaseException) -> str:
    return f"{type(error).__name__}: {' '.join(str(error).split())[:200]}"
