"""Messages that a node sends: in the publishing thread, complete, and in order."""

import os
import socket
import subprocess
import sys
import threading

import pytest

pytest.importorskip("rospy")

from rospy.impl.tcpros_pubsub import QueuedConnection
from rospy.impl.transport import Transport

from drone_sim.ros.core import startup


class Connection(Transport):
    """A connection to a subscriber; `far` is the subscriber's end."""

    def __init__(self):
        super().__init__(0)
        self.socket, self.far = socket.socketpair()
        self.senders = []

    def write_data(self, data):
        self.senders.append(threading.current_thread())
        self.socket.sendall(data)


@pytest.fixture(name="connection")
def _connection():
    connection = Connection()
    connection.queued = QueuedConnection(connection, 1)
    wait_until(lambda: connection.queued._cond_data_available._waiters)
    yield connection
    connection.close()
    connection.socket.close()
    connection.far.close()


def wait_until(condition):
    end = threading.Event()
    for _ in range(500):
        if condition():
            return
        end.wait(0.01)
    raise AssertionError("it took too long")


def test_small_message_is_sent_immediately_by_the_publishing_thread(connection):
    assert startup._send(connection.queued, b"one")
    connection.far.setblocking(False)
    assert connection.far.recv(10) == b"one"
    assert not connection.senders, "the thread of the queue was not used"
    assert (connection.stat_bytes, connection.stat_num_msg) == (3, 1)


def test_message_that_exceeds_the_socket_buffer_arrives_completely(connection):
    message, sent = os.urandom(startup._MAX_AT_ONCE), 0
    connection.queued._queue_size = 0  # unlimited: the thread may not have started when the next message comes
    while not connection.senders:  # until the kernel accepts only a part
        startup._send(connection.queued, message)
        sent += 1
    startup._send(connection.queued, b"last")
    connection.far.settimeout(5)
    received = b""
    while len(received) < sent * len(message) + 4:
        received += connection.far.recv(1 << 20)
    assert received == sent * message + b"last"


def test_slow_subscriber_gets_the_last_message_and_does_not_block_the_sender(connection):
    for number in range(1000):
        startup._send(connection.queued, bytes([number % 251]) * startup._MAX_AT_ONCE)
    received = bytearray()
    while not received.endswith(bytes([999 % 251]) * startup._MAX_AT_ONCE):
        received += connection.far.recv(1 << 20)
    assert len(received) % startup._MAX_AT_ONCE == 0
    whole = [received[at : at + startup._MAX_AT_ONCE] for at in range(0, len(received), startup._MAX_AT_ONCE)]
    assert all(len(set(message)) == 1 for message in whole), "each message is whole"


@pytest.mark.parametrize(("asked", "given"), [("7", 7), ("0", 0), ("", 0), ("many", 0), ("-3", 0), ("99", 0)])
def test_niceness_of_a_node_is_set_by_the_environment(asked, given):
    code = "import os; from drone_sim.ros.core.startup import give_way; give_way(); give_way(); print(os.nice(0))"
    environment = {**os.environ, "DRONE_SIM_NICENESS": asked}
    output = subprocess.check_output([sys.executable, "-c", code], env=environment, text=True)
    assert int(output) == max(given, os.nice(0))
