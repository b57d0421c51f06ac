"""Rig agents of the benches of a service: where each one is, its connection, and its supervision."""

import logging
from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

from bench.agent_protocol import AgentClient, AgentEndpoint, Sender, derive_samples_address, find_agent
from bench.config import DEFAULT_BENCH, check_bench_name
from bench.errors import ConfigError
from bench.service.agent_monitor import AgentLink, NoAgent
from bench.service.agent_supervisor import SupervisedAgent
from bench.service.application import LOOPBACK_NAMES
from bench.service.benches import BenchSettings
from bench.service.processes import (
    get_agent_log,
    is_answering,
    launch_agent,
    shut_down_idle_agent,
    start_agent,
)

_LOG = logging.getLogger(__name__)
_FORM = "give NAME=bench.toml, or NAME=tcp://HOST:PORT,KEYFILE for an agent elsewhere"


@dataclass(frozen=True)
class BenchPlace:
    """Name of a bench, and where its rig agent is; without config and address the bench has none."""

    name: str = DEFAULT_BENCH
    config: Path | None = None
    """``bench.toml`` of the rig."""
    address: str | None = None
    """Address of the agent's command socket; the agent publishes at the next port, or at NAME.samples."""
    key: Path | None = None
    """Key file of an agent at a TCP address."""

    def __str__(self) -> str:
        return self.address or (str(self.config.resolve()) if self.config is not None else "")

    def find_endpoint(self) -> AgentEndpoint | None:
        """Return the addresses of the agent; None without an agent.

        Raises:
            ConfigError: ``bench.toml`` or the address is not valid.
        """
        if self.address is not None:
            return AgentEndpoint(self.address, derive_samples_address(self.address), self.key)
        return None if self.config is None else find_agent(self.config)


def parse_benches(texts: Sequence[str]) -> tuple[BenchPlace, ...]:
    """Return the benches of a command line, each as ``NAME=bench.toml`` or ``NAME=tcp://HOST:PORT,KEYFILE``.

    Raises:
        ConfigError: a text has another form, a name cannot be used, or two benches have one name.
    """
    places = tuple(map(_parse_bench, texts))
    names = [place.name for place in places]
    double = next((name for name in names if names.count(name) > 1), None)
    if double is not None:
        raise ConfigError(f"two benches have the name {double}; give each bench a name of its own")
    return places


def _parse_bench(text: str) -> BenchPlace:
    name, separator, place = text.partition("=")
    if not separator or not place:
        raise ConfigError(f"{text!r} is not a bench; {_FORM}")
    check_bench_name(name)
    if not place.startswith(("tcp://", "ipc://")):
        return BenchPlace(name, config=Path(place))
    address, _, key = place.partition(",")
    return BenchPlace(name, address=address, key=Path(key) if key else None)


class BenchAgent:
    """Rig agent of one bench, as the process of the service sees it."""

    def __init__(self, place: BenchPlace, endpoint: AgentEndpoint | None) -> None:
        """Use an agent, or none; nothing is sent."""
        self.place, self.name = place, place.name
        self._commands = None if endpoint is None else endpoint.commands
        self._link: AgentLink = (
            NoAgent() if endpoint is None else AgentClient(*endpoint, sender=Sender(actor="service"))
        )
        self._supervisor: SupervisedAgent | None = None

    def supervise(self, data: Path, *, is_started: bool, is_only: bool) -> None:
        """Prepare the supervision of the agent of a ``bench.toml``; start a missing one if this is wanted.

        The start of the only agent is waited for. One of several is left to its supervision: a bench whose agent
        does not start must not prevent the others.

        Args:
            data: data folder.
            is_started: start the agent, and start it again when it dies.
            is_only: whether the service has one bench only.

        Raises:
            ServiceError: the only agent ends at once, or does not answer.
            ConfigError: ``bench.toml`` is not valid.
        """
        config, link = self.place.config, self._link
        if config is None or self.place.address is not None:
            return
        log = get_agent_log(data, self.name)
        if not is_started:
            self._supervisor = SupervisedAgent(config, link, log, None)
            return
        process = None
        if is_answering(link):
            _LOG.info("agent_found", extra={"config": str(config)})
        else:
            process = start_agent(config, link, log) if is_only else launch_agent(config, log)
        self._supervisor = SupervisedAgent(config, link, log, lambda: launch_agent(config, log), process)

    @property
    def supervision(self) -> AbstractContextManager[object]:
        """Context in which the agent is supervised."""
        return self._supervisor or nullcontext()

    def make_settings(self) -> BenchSettings:
        """Return the bench for the application."""
        has_local_logs = self._commands is None or is_local(self._commands)
        return BenchSettings(self._supervisor or self._link, has_local_logs, self.name)

    def shut_down_if_started(self) -> str | None:
        """Shut down an idle agent that this service has started; return its state for a person, else None."""
        if self._supervisor is None or not self._supervisor.has_started:
            return None
        return shut_down_idle_agent(self._link)


def make_agents(places: Sequence[BenchPlace]) -> tuple[BenchAgent, ...]:
    """Return the agents of benches; nothing is sent or started.

    Raises:
        ConfigError: a ``bench.toml`` or an address is not valid, or two benches have one agent.
    """
    endpoints = [place.find_endpoint() for place in places]
    owners: dict[str, str] = {}
    for place, endpoint in zip(places, endpoints, strict=True):
        if endpoint is None:
            continue
        other = owners.setdefault(endpoint.commands, place.name)
        if other != place.name:
            raise ConfigError(
                f"the benches {other} and {place.name} have the same rig agent, {endpoint.commands}; "
                "give each bench a bench.toml of its own"
            )
    return tuple(BenchAgent(*pair) for pair in zip(places, endpoints, strict=True))


def is_local(address: str) -> bool:
    """Return whether an agent is on this machine."""
    return not address.startswith("tcp://") or urlsplit(address).hostname in LOOPBACK_NAMES
