"""Sender of commands: stated by the client, and the peer that the agent sees at its socket."""

import os
import pwd
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from bench.agent_protocol.commands import Sender

_PEER = re.compile(r"[^:]*:(\d+):\d+:(\d+)")
"""Peer of a Unix socket, as ZeroMQ names it: host, user, group, process."""
_CURRENT: ContextVar[Callable[[], Sender] | None] = ContextVar("sender", default=None)


@contextmanager
def send_as(describe: Callable[[], Sender]) -> Iterator[None]:
    """Send the commands of a block, and of what it calls, on behalf of somebody.

    Args:
        describe: returns the sender when a command is sent.
    """
    token = _CURRENT.set(describe)
    try:
        yield
    finally:
        _CURRENT.reset(token)


def get_sender(default: Sender | None = None) -> Sender:
    """Return the sender of the present block; outside of one the default, or the account of this process."""
    describe = _CURRENT.get()
    if describe is not None:
        return describe()
    return default or Sender(actor=f"local:{name_account(os.getuid())}")


def name_account(uid: int) -> str:
    """Return the name of an account, or its number if it has none."""
    try:
        return pwd.getpwuid(uid).pw_name
    except KeyError:
        return str(uid)


def describe_peer(address: str, peer: str) -> str:
    """Return the peer of a socket for a person: account and process, or network address.

    Args:
        address: address at which the agent listens.
        peer: peer as ZeroMQ names it.
    """
    found = _PEER.fullmatch(peer) if address.startswith("ipc://") else None
    return f"account {name_account(int(found[1]))}, process {found[2]}" if found else peer
