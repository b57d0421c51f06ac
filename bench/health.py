"""Health of the processes of a bench: each one answers at its socket, or the error says what is missing."""

import json
import socket
from pathlib import Path
from typing import Literal, TypeAlias
from urllib.parse import urlsplit
from urllib.request import urlopen

from bench.errors import BenchError

Part: TypeAlias = Literal["instruments", "agent", "scheduler", "service", "worker"]
"""Part of a bench whose health can be asked for."""
_MODBUS_PORT = 502
"""Port of an address without one."""
_TIMEOUT = 5.0
"""[s] Time for an answer."""


class HealthError(BenchError):
    """A part of the bench does not answer."""


def check_part(part: Part, config: Path, data: Path, url: str) -> str:
    """Return the state of a part in words.

    Args:
        part: instruments with a TCP address, rig agent, scheduler of the jobs, service, or its workers.
        config: ``bench.toml``.
        data: data folder of the service.
        url: address of the service.

    Raises:
        HealthError: the part does not answer.
        ConfigError: ``bench.toml`` is not valid.
        AgentUnreachableError: the rig agent does not answer.
    """
    match part:
        case "instruments":
            return check_instruments(config)
        case "agent":
            return _check_agent(config)
        case "scheduler":
            return _check_scheduler(data)
        case "service":
            return f"mrbench {_fetch_health(url)['version']}"
        case "worker":
            return _check_worker(url)


def check_instruments(config: Path) -> str:
    """Connect to every TCP address of the instruments; meant for simulated ones, which accept several hosts."""
    from bench.config import ActuatorSection, load_config

    addresses = []
    for section in load_config(config).instruments.values():
        if not isinstance(section, ActuatorSection):
            addresses += [section.url] if section.url.startswith("tcp://") else []
        elif section.interface == "socketcand":
            addresses.append(f"tcp://{section.host}:{section.port}")
    for address in addresses:
        _connect(address)
    return f"{len(addresses)} addresses answer"


def _check_agent(config: Path) -> str:
    from bench.agent_protocol import AgentClient, StatusCommand, find_agent

    reply = AgentClient(*find_agent(config)).send(StatusCommand(), _TIMEOUT)
    return reply.status.state if reply.status else "answers"


def _check_scheduler(data: Path) -> str:
    # Not read with the jobs' own modules: they need a second to load, and this is called often.
    file = data / "scheduler.address"
    try:
        address = file.read_text("utf-8")
    except OSError as error:
        raise HealthError(f"{file}: no scheduler has written its address ({error.strerror})") from None
    _connect(address)
    return f"listens at {address}"


def _check_worker(url: str) -> str:
    worker = str(_fetch_health(url)["worker"])
    if worker != "ok":
        raise HealthError(f"worker: {worker}")
    return "connected"


def _connect(address: str) -> None:
    parts = urlsplit(address)
    try:
        socket.create_connection((parts.hostname or "", parts.port or _MODBUS_PORT), _TIMEOUT).close()
    except OSError as error:
        raise HealthError(f"{address}: nothing answers ({error})") from None


def _fetch_health(url: str) -> dict[str, object]:
    try:
        with urlopen(f"{url.rstrip('/')}/api/v1/health", timeout=_TIMEOUT) as reply:
            health: dict[str, object] = json.load(reply)
    except (OSError, ValueError) as error:
        raise HealthError(f"{url}: the service does not answer ({error})") from None
    return health
