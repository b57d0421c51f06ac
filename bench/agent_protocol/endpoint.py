"""Addresses of the rig agent: sockets as files of the user, or TCP with a key.

By default the agent has two sockets in a private folder. They are named by its ``bench.toml``, so that every
process that has this file finds them.
"""

import hashlib
import os
import stat
import tempfile
from pathlib import Path
from typing import Final, NamedTuple
from urllib.parse import urlsplit

from bench.config import AgentSection, load_config
from bench.errors import ConfigError

SOCKET_FOLDER_VARIABLE: Final = "MRBENCH_SOCKETS"
"""Environment variable that names another folder for the sockets."""
_MAX_PATH_BYTES = 107
"""Length of a socket's path that the operating system accepts [bytes]."""
_OTHERS = stat.S_IRWXG | stat.S_IRWXO
_FORM = "tcp://HOST:PORT or ipc:///FOLDER/NAME"


class AgentEndpoint(NamedTuple):
    """Addresses of an agent, and the file with the key of TCP connections."""

    commands: str
    samples: str
    key: Path | None = None


def find_agent(config: Path, commands: str | None = None, samples: str | None = None) -> AgentEndpoint:
    """Return the endpoint of the agent of a bench.

    Args:
        config: ``bench.toml``.
        commands: address for commands, instead of the configured one.
        samples: publishing address, instead of the configured one.

    Raises:
        ConfigError: the configuration is not valid, or the folder of the sockets is not private.
    """
    return make_endpoint(load_config(config).agent, config, commands, samples)


def make_endpoint(
    section: AgentSection, config: Path, commands: str | None = None, samples: str | None = None
) -> AgentEndpoint:
    """Return the endpoint that a section of ``bench.toml`` describes; arguments as those of `find_agent`.

    Raises:
        ConfigError: the folder of the sockets is not private, or an address is not valid.
    """
    chosen = commands or section.commands or _make_socket_address(config)
    published = samples or (section.samples if commands is None else "") or derive_samples_address(chosen)
    return AgentEndpoint(chosen, published, config.parent / section.key)


def derive_samples_address(commands: str) -> str:
    """Return the publishing address that belongs to an address for commands: the next port, or NAME.samples.

    Raises:
        ConfigError: the address is not valid.
    """
    if commands.startswith("ipc://"):
        return f"{commands}.samples"
    if commands.startswith("tcp://") and commands.endswith(":*"):
        return commands
    try:
        parts = urlsplit(commands)
        if parts.scheme != "tcp" or parts.hostname is None or parts.port is None:
            raise ValueError(commands)
    except ValueError:
        raise ConfigError(f"{commands}: not an address of a rig agent; give {_FORM}") from None
    return f"tcp://{parts.netloc.rpartition(':')[0]}:{parts.port + 1}"


def check_socket_path(address: str) -> Path:
    """Return the path of an ``ipc://`` address.

    Raises:
        ConfigError: the path is not absolute or too long, or other users could reach or replace the socket.
    """
    path = Path(address.removeprefix("ipc://"))
    if not path.is_absolute():
        raise ConfigError(f"{address}: not the absolute path of a socket; give {_FORM}")
    if (length := len(os.fsencode(path))) > _MAX_PATH_BYTES:
        raise ConfigError(
            f"{address}: a path of {length} bytes, allowed {_MAX_PATH_BYTES}; "
            f"set {SOCKET_FOLDER_VARIABLE} to a folder with a shorter path"
        )
    _check_private_folder(path.parent)
    return path


def _make_socket_address(config: Path) -> str:
    """Return the address of a bench's socket in the user's private folder, which is created unless it exists."""
    folder = _get_socket_folder()
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(
            f"{folder}: cannot be created ({error.strerror}); set {SOCKET_FOLDER_VARIABLE} to a folder of your own"
        ) from None
    name = hashlib.sha256(os.fsencode(config.resolve())).hexdigest()[:16]
    address = f"ipc://{folder}/{name}"
    check_socket_path(derive_samples_address(address))
    return address


def _get_socket_folder() -> Path:
    # Not the session's runtime folder: it is removed when the user logs out, and the agent has to go on.
    given = os.environ.get(SOCKET_FOLDER_VARIABLE)
    return Path(given).absolute() if given else Path(tempfile.gettempdir()) / f"mrbench-{os.getuid()}"


def _check_private_folder(folder: Path) -> None:
    """Raise ConfigError unless a folder belongs to this user and to nobody else."""
    advice = f"use a folder of mode 0700 of your own (chmod 700, or {SOCKET_FOLDER_VARIABLE})"
    try:
        state = folder.lstat()
    except OSError as error:
        raise ConfigError(f"{folder}: no folder for the agent's sockets ({error.strerror}); {advice}") from None
    if not stat.S_ISDIR(state.st_mode):
        raise ConfigError(f"{folder}: not a folder, so it cannot hold the agent's sockets; {advice}")
    if state.st_uid != os.getuid() or state.st_mode & _OTHERS:
        raise ConfigError(
            f"{folder}: other users can reach the agent's sockets there (owner {state.st_uid}, "
            f"mode {stat.S_IMODE(state.st_mode):04o}); {advice}"
        )
