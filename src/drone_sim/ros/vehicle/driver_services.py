"""Services under a driver's names, and the topics and services whose types are not installed."""

from __future__ import annotations

import contextlib
from collections import defaultdict
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import rospy

from drone_sim.config.types import ParameterError
from drone_sim.ros.core.inbox import Inbox
from drone_sim.ros.core.message_conversion import full_name, service_class
from drone_sim.vehicles.commands import REQUESTS
from drone_sim.vehicles.driver import DriverTopic
from drone_sim.vehicles.parameters import VehicleParameters

_SUCCESS = "success", "result"  # fields of responses that say whether it worked


class Missing:
    """The topics and services that are not there, because a package is not in the user's workspace."""

    def __init__(self) -> None:
        self._names: dict[str, list[str]] = defaultdict(list)  # by package

    @contextlib.contextmanager
    def noted(self, kind: str | None, name: str) -> Iterator[None]:
        """Note the topic or service if its type cannot be found: message_class and service_class raise ValueError."""
        try:
            yield
        except ParameterError:  # of a field of an installed type
            raise
        except ValueError:
            self._names[str(kind).partition("/")[0]].append(rospy.resolve_name(name))

    def warn(self) -> None:
        """Log one line for each package."""
        for package, names in self._names.items():
            rospy.logwarn(f"the package {package} is not in your workspace, so these are not there: {', '.join(names)}")


class DriverServices:
    """The services of one vehicle under a driver's names."""

    def __init__(self, parameters: VehicleParameters, inbox: Inbox, ask: Callable[[str], None], missing: Missing):
        """Advertise. `ask` asks the vehicle for what a topic of REQUESTS does; the thread of `inbox` calls it."""
        self._inbox, self._ask = inbox, ask
        self._servers = []
        for entry in parameters.topics.values():
            name = full_name(parameters.name, entry.topic)
            if entry.service:
                with missing.noted(entry.type, name):
                    kind = service_class(str(entry.type))
                    self._servers.append(rospy.Service(name, kind, partial(self._answer, entry, kind._response_class)))

    def _answer(self, entry: DriverTopic, make_response: type, request: Any) -> Any:
        """Do what the service says: `motors` with a request for false stops the propellers."""
        stops = entry.takes == "motors" and not getattr(request, request.__slots__[0])
        asked = "emergency" if stops else str(entry.takes)
        if asked in REQUESTS:
            self._inbox.put(lambda: self._ask(asked))
        response = make_response()
        for field in _SUCCESS:
            if hasattr(response, field):
                setattr(response, field, True)
        return response

    def close(self) -> None:
        """End the services."""
        for server in self._servers:
            server.shutdown("the vehicle is gone, or its topics have changed")
