"""Clients of the remote API: CoppeliaSim's own, and one that does what the test says, message by message."""

import itertools

import cbor2
import pytest
import zmq

PATIENCE = 60_000  # ms, after which a test fails whose server has ended
_numbers = itertools.count(1)


def official_client(port):
    """Return CoppeliaSim's own client, which by itself would wait for ever for a server that has ended."""
    client = pytest.importorskip("coppeliasim_zmqremoteapi_client").RemoteAPIClient(port=port)
    client.socket.setsockopt(zmq.RCVTIMEO, PATIENCE)
    client.socket.setsockopt(zmq.LINGER, 0)
    return client


class Refusal(Exception):
    """The `err` of a reply."""


class Client:
    """Speaks version 2 of the protocol; `server` is served while an answer is awaited."""

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
        """Serve until there is an answer, or for so many looks; return whether there is."""
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
        """Return what the official client's functions return; raises Refusal."""
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
