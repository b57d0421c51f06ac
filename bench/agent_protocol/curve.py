"""Key of TCP connections to the agent: encryption and mutual authentication by ZeroMQ's CURVE.

Agent and clients have the same key pair, in one file. Each side accepts only the other that has it.
"""

import contextlib
from collections.abc import Iterator
from pathlib import Path

import zmq
from zmq.auth.thread import ThreadAuthenticator

from bench.private_file import check_private_file, create_private_file

_PURPOSE = "the key of the rig agent, which creates it at its first start; copy it from beside its bench.toml"


class _KeyCheck:
    """Credentials provider that accepts one public key."""

    def __init__(self, public: bytes) -> None:
        self._public = public

    def callback(self, domain: str, key: bytes) -> bool:
        """Return whether a client has the key."""
        return key == self._public


def create_key(path: Path) -> None:
    """Create a key file unless it exists.

    Raises:
        SecretFileError: it cannot be created.
    """
    create_private_file(path, lambda: zmq.curve_keypair()[1].decode())


@contextlib.contextmanager
def authenticate_clients(socket: "zmq.Socket[bytes]", path: Path) -> Iterator[None]:
    """Let a socket that is not bound yet accept only clients with the key.

    Raises:
        SecretFileError: the file is missing, or other users may read it.
    """
    secret, public = _read_key(path)
    socket.curve_server, socket.curve_secretkey = True, secret
    # Without it, every client that has the public key of the server would be accepted.
    authenticator = ThreadAuthenticator(socket.context)
    authenticator.start()
    try:
        authenticator.configure_curve_callback("*", _KeyCheck(public))
        yield
    finally:
        authenticator.stop()


def authenticate_server(socket: "zmq.Socket[bytes]", path: Path) -> None:
    """Let a socket that is not connected yet accept only a server with the key.

    Raises:
        SecretFileError: the file is missing, or other users may read it.
    """
    secret, public = _read_key(path)
    socket.curve_serverkey, socket.curve_publickey, socket.curve_secretkey = public, public, secret


def _read_key(path: Path) -> tuple[bytes, bytes]:
    """Return the secret and the public key."""
    check_private_file(path, _PURPOSE)
    secret = path.read_bytes().strip()
    return secret, zmq.curve_public(secret)
