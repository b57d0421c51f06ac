"""Heartbeat of a CANopen node: state, age and restarts, without a bus."""

from types import SimpleNamespace

import pytest

from drivers.errors import NoReplyError
from drivers.transport.canopen_heartbeat import HeartbeatConsumer

SECOND = 1_000_000_000


class Node:
    """Heartbeat consumer with a time limit of 0.25 s, whose clock the test sets."""

    def __init__(self):
        self.now = 50 * SECOND
        bus = SimpleNamespace(check_open=lambda: None)
        self.heartbeat = HeartbeatConsumer("rod", bus, lambda: self.now, 0.25)


@pytest.mark.parametrize(("age_ns", "is_alive"), [(0, True), (SECOND // 4, True), (SECOND // 4 + 1_000, False)])
def test_a_node_is_alive_until_its_heartbeat_is_too_old(age_ns, is_alive):
    node = Node()
    node.heartbeat.on_heartbeat(node.now, b"\x05")
    node.now += age_ns
    if is_alive:
        node.heartbeat.check_alive()
    else:
        with pytest.raises(NoReplyError, match=r"no heartbeat for 0\.250 s, 0\.25 s are allowed"):
            node.heartbeat.check_alive()


def test_a_node_without_a_heartbeat_is_not_alive():
    node = Node()
    with pytest.raises(NoReplyError, match="no heartbeat since it was connected"):
        node.heartbeat.check_alive()
    assert node.heartbeat.state == "unknown, without a heartbeat"
    node.heartbeat.on_heartbeat(node.now, b"\x05")
    node.heartbeat.reset()
    with pytest.raises(NoReplyError, match="since it was connected"):
        node.heartbeat.check_alive()


def test_each_boot_message_counts_and_the_toggle_bit_does_not():
    node = Node()
    for data in (b"\x05", b"\x00", b"\x80", b"\x85", b"\x7f"):
        node.heartbeat.on_heartbeat(node.now, data)
    assert node.heartbeat.boot_count == 2
    node.heartbeat.wait_for_state(127, 0.0)
    with pytest.raises(NoReplyError, match=r"waited 0 s for state"):
        node.heartbeat.wait_for_state(5, 0.0)


def test_the_present_heartbeat_is_not_the_next_one():
    node = Node()
    node.heartbeat.on_heartbeat(node.now, b"\x05")
    with pytest.raises(NoReplyError, match="waited 0 s for a heartbeat"):
        node.heartbeat.wait_for_next(0.0)
