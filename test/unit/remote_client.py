"""Clients of the ZeroMQ remote API: CoppeliaSim's own client, and a client that a test controls by message."""

import itertools

import cbor2
import pytest
import zmq

PATIENCE = 60_000  # ms until a test fails if its server has ended
_numbers = itertools.count(1)


def official_client(port):
    """Return CoppeliaSim's own client with a timeout, since it waits for ever if the server has ended."""
    client = pytest.importorskip("coppeliasim_zmqremoteapi_client").RemoteAPIClient(port=port)
    client.socket.setsockopt(zmq.RCVTIMEO, PATIENCE)
    client.socket.setsockopt(zmq.LINGER, 0)
    return client


class Refusal(Exception):
    """The `err` of a reply."""


class Client:
    """A client for version 2 of the protocol that serves `server` while it waits for a reply."""

    def __init__(self, server, kind=zmq.REQ, **fields):
        self.fields = {"uuid": f"client {next(_numbers)}", **fields}
        self._server = server
        self._context = zmq.Context()
        self._socket = self._context.socket(kind)
        self._socket.setsockopt(zmq.LINGER, 0)
        self._socket.connect(f"tcp://127.0.0.1:{server.port}")

    def send(self, function, *arguments):
        request = {"func": function, "args": list(arguments), "argsL": len(arguments), **self.fields}
        self.send_bytes(cbor2.dumps(request))

    def send_bytes(self, payload):
        self._socket.send(payload)

    def answered(self, looks=5000):
        """Serve until a reply has arrived, at most `looks` times; return whether it has."""
        for _ in range(looks):
            if self._socket.poll(0):
                return True
            self._server.wait(0.001)
        return False

    def reply(self):
        assert self.answered()
        return cbor2.loads(self._socket.recv())

    def ask(self, function, *arguments):
        self.send(function, *arguments)
        return self.reply()

    def call(self, function, *arguments):
        """Return the same value as the official client's functions, or raise Refusal."""
        reply = self.ask(function, *arguments)
        if "err" in reply:
            raise Refusal(reply["err"])
        values = reply["ret"]
        return None if not values else values[0] if len(values) == 1 else tuple(values)

    def sim(self, name, *arguments):
        return self.call(f"sim.{name}", *arguments)

    def vanish(self):
        self._socket.close()
        self._context.term()
