"""`simROS`: topics, services, time, frames and parameters, with or without ROS.

Without ROS, transforms are not sent, parameters exist only for the script, and there are no services.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from drone_sim.mechanics.clock import Clock
from drone_sim.scripting.api.backend import Image
from drone_sim.scripting.api.calls import simROS
from drone_sim.scripting.api.messages import MessageBus
from drone_sim.scripting.api.types import Callback, Handle, Name, WrongValue, refuse_if_too_large

_MOST = 100  # service clients


class TopicFunctions:
    """Topics, with or without ROS."""

    def __init__(self, bus: MessageBus):
        self._bus = bus

    @simROS()
    def subscribe(self, topic: Name, kind: Name, callback: Callback, queue: int = 1, *_ignored: Any) -> int:
        """Call the script's function `callback` with each message on `topic`; return a handle.

        Of the messages that arrive during a step, the last `queue` are kept; V-REP's 0 means 1. If the topic, type and
        callback are subscribed already, their handle is returned; V-REP would call the callback once more.
        """
        return self._bus.subscribe(topic, kind, callback, int(queue))

    @simROS()
    def shutdownSubscriber(self, handle: Handle) -> None:
        """End a subscription."""
        self._bus.end_subscription(handle)

    @simROS()
    def advertise(self, topic: Name, kind: Name, queue: int = 1, latch: bool = False, *_ignored: Any) -> int:
        """Advertise a topic; return a handle for publish."""
        return self._bus.advertise(topic, kind, int(queue), bool(latch))

    @simROS()
    def publish(self, handle: Handle, message: Any) -> None:
        """Publish a message: a table of its fields."""
        if message is None or isinstance(message, (str, bytes, int, float)):
            raise WrongValue("expected a table of the message's fields")
        refuse_if_too_large(message)
        self._bus.publish(handle, message)

    @simROS()
    def shutdownPublisher(self, handle: Handle) -> None:
        """Stop advertising a topic."""
        self._bus.end_publisher(handle)

    @simROS("")
    def getNumSubscribers(self, handle: Handle) -> int:
        """Return the number of subscribers of a published topic; V-REP has no such function."""
        return self._bus.subscribers(handle)

    @simROS()
    def publisherTreatUInt8ArrayAsString(self, handle: Handle) -> None:
        """Do nothing: uint8[] may always be a string or a table."""
        self._bus.subscribers(handle)

    @simROS()
    def subscriberTreatUInt8ArrayAsString(self, handle: Handle) -> None:
        """Do nothing: uint8[] is always a string; string.byte(data, 1) is its first byte."""
        self._bus.check_subscription(handle)

    @simROS()
    def imageTransportAdvertise(self, topic: Name, queue: int = 1) -> int:
        """Advertise an image topic; return a handle for imageTransportPublish."""
        return self._bus.advertise_image(topic, int(queue))

    @simROS()
    def imageTransportPublish(self, handle: Handle, data: Any, width: int, height: int, frame_id: Name) -> None:
        """Publish an image from getVisionSensorCharImage, bottom row first."""
        self._bus.publish(handle, Image(_top_row_first(data, width, height), frame_id))

    @simROS()
    def imageTransportShutdownPublisher(self, handle: Handle) -> None:
        """Stop advertising an image topic."""
        self._bus.end_publisher(handle)


class ServiceFunctions:
    """Services that a script offers to others, with or without ROS."""

    def __init__(self, bus: MessageBus):
        self._bus = bus

    @simROS()
    def advertiseService(self, name: Name, kind: Name, callback: Callback) -> int:
        """Offer a service: `callback` is called with each request, and returns a table of the response's fields.

        It is called at the beginning of the next step. A client waits for at most 5 s.
        """
        return self._bus.offer(name, kind, callback)

    @simROS()
    def shutdownServiceServer(self, handle: Handle) -> None:
        """Stop offering a service."""
        self._bus.end_subscription(handle, is_service=True)

    @simROS()
    def serviceServerTreatUInt8ArrayAsString(self, handle: Handle) -> None:
        """Do nothing: uint8[] is always a string."""
        self._bus.check_subscription(handle, is_service=True)


class RosFunctions:
    """Time, frames, parameters and services of other nodes, with or without ROS."""

    def __init__(self, bus: MessageBus, clock: Clock):
        """`bus` has the backend and completes names; `clock` is the simulation's."""
        self._bus = bus
        self._clock = clock
        self._own: dict[str, Any] = {}  # parameters, without ROS
        self._clients: dict[int, tuple[str, str]] = {}

    @simROS()
    def getTime(self, _flag: int = 0) -> float:
        """Return the time of ROS in s, for stamps of messages."""
        backend = self._bus.backend
        return backend.time() if backend is not None else self._clock.time

    # ---- frames

    @simROS()
    def sendTransform(self, transform: Mapping[str, Any]) -> None:
        """Broadcast a transform, a table with the fields of geometry_msgs/TransformStamped."""
        self.sendTransforms([transform])

    @simROS()
    def sendTransforms(self, transforms: Sequence[Mapping[str, Any]]) -> None:
        """Broadcast several transforms."""
        refuse_if_too_large(transforms)
        if isinstance(transforms, Mapping) or any(not isinstance(item, Mapping) for item in transforms):
            raise WrongValue("expected tables with the fields of geometry_msgs/TransformStamped")
        if self._bus.backend is not None:
            self._bus.backend.send_transforms(list(transforms))

    # ---- parameters

    @simROS()
    def hasParam(self, name: Name) -> bool:
        """Return whether a parameter is set."""
        return self._read(name)[0]

    @simROS()
    def deleteParam(self, name: Name) -> None:
        """Delete a parameter."""
        full, backend = self._name(name), self._bus.backend
        if backend is not None:
            backend.delete_parameter(full)
        else:
            self._own.pop(full, None)

    @simROS()
    def searchParam(self, name: Name) -> tuple[bool, str]:
        """Return whether a parameter is set in the drone's namespace or above, and its complete name ('' for none)."""
        space = "" if name.startswith("/") else self._name("x").rpartition("/")[0]
        name = name.lstrip("/")
        while True:
            full = f"{space}/{name}"
            if self._read(full)[0]:
                return True, full
            if not space:
                return False, ""
            space = space.rpartition("/")[0]

    def _read(self, name: str) -> tuple[bool, Any]:
        full, backend = self._name(name), self._bus.backend
        value = backend.parameter(full) if backend is not None else self._own.get(full)
        return value is not None, value

    def _write(self, name: str, value: Any) -> None:
        full, backend = self._name(name), self._bus.backend
        if backend is not None:
            backend.set_parameter(full, value)
        else:
            self._own[full] = value

    def _name(self, name: str) -> str:
        """Return the complete name of a parameter. Raises WrongValue, ValueError."""
        if not isinstance(name, str) or not name.strip("/"):
            raise WrongValue("expected the name of a parameter")
        return self._bus.resolved("parameter", name)

    # ---- services of other nodes

    @simROS()
    def serviceClient(self, name: Name, kind: Name) -> int:
        """Return a handle for calls of a service."""
        if len(self._clients) >= _MOST:
            raise ValueError(f"a script may have at most {_MOST} service clients")
        handle = len(self._clients) + 1
        self._clients[handle] = self._bus.resolved("service", name), kind
        return handle

    @simROS()
    def call(self, handle: Handle, request: Any = None) -> Any:
        """Call a service with a table of the request's fields; return the response.

        This may take a second of real time.
        """
        name, kind = self._client(handle)
        refuse_if_too_large(request)
        if self._bus.backend is None:
            raise ValueError("this flight runs without ROS, so there are no services")
        return self._bus.backend.call_service(name, kind, request or {})

    @simROS()
    def shutdownServiceClient(self, handle: Handle) -> None:
        """Remove a service client."""
        self._client(handle)
        del self._clients[handle]

    @simROS()
    def serviceClientTreatUInt8ArrayAsString(self, handle: Handle) -> None:
        """Do nothing: uint8[] is always a string."""
        self._client(handle)

    def _client(self, handle: int) -> tuple[str, str]:
        if handle not in self._clients:
            raise ValueError(f"there is no service client with the handle {handle}")
        return self._clients[handle]


def _add_kind(word: str, kind: type[Any]) -> None:
    """Add the functions for parameters of one type."""

    def get(self: RosFunctions, name: Name, default: Any = None) -> tuple[bool, Any]:
        is_set, value = self._read(name)
        is_right = isinstance(value, (int, float)) if kind is float else isinstance(value, kind)
        if not is_set or not is_right:
            return False, kind() if default is None else default
        return True, kind(value)

    def put(self: RosFunctions, name: Name, value: Any) -> None:
        try:
            value = kind(value)
        except (TypeError, ValueError):
            raise WrongValue(f"expected a value of the type {kind.__name__}") from None
        self._write(name, value)

    doc = "Return whether a parameter of this type is set, and its value or the default."
    simROS.add(RosFunctions, get, f"getParam{word}", doc)
    simROS.add(RosFunctions, put, f"setParam{word}", "Set a parameter.")


for _word, _kind in {"String": str, "Int": int, "Double": float, "Bool": bool}.items():
    _add_kind(_word, _kind)


def _top_row_first(data: Any, width: int, height: int) -> np.ndarray:
    """Return a flipped view of an image, (height, width, 3). Raises WrongValue, ValueError."""
    if isinstance(data, int):
        raise WrongValue("expected an image")
    refuse_if_too_large(data)
    pixels = data.encode("utf-8") if isinstance(data, str) else bytes(data)
    row, rows = 3 * int(width), int(height)
    if row <= 0 or rows <= 0:
        raise ValueError(f"an image cannot have {width} x {height} pixels")
    if len(pixels) != row * rows:
        raise ValueError(f"an image of {width} x {height} must have {row * rows} bytes, not {len(pixels)}")
    return np.frombuffer(pixels, np.uint8).reshape(rows, -1, 3)[::-1]
