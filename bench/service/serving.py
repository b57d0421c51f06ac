"""Puts the service together and serves until it is told to end."""

import fcntl
import logging
import signal
import socket
from collections.abc import Callable, Iterator
from contextlib import AbstractAsyncContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

import uvicorn

from bench.agent.link import AgentClient
from bench.jobs.engine import Engine
from bench.rig.config import load_config
from bench.service.access import open_access
from bench.service.agent_watch import AgentLink, NoAgent
from bench.service.application import LOOPBACK_NAMES, Surroundings, create_app
from bench.service.errors import ServiceError
from bench.service.log_lines import log_to_stderr
from bench.service.processes import answers, engine_at, leave_agent, local_engine, start_agent

_LOG = logging.getLogger(__name__)
_GRACE = 5
"""[s] for open calls at the end."""


@dataclass(frozen=True)
class Wanted:
    """How the service is wanted."""

    data: Path
    host: str = "127.0.0.1"
    port: int = 8600
    """0 for any free one."""
    config: Path | None = None
    """``bench.toml``; an agent is started with it where none answers."""
    agent: str | None = None
    """Address of an agent's commands; it publishes at the next port."""
    scheduler: str | None = None
    new_token: bool = False


def serve(wanted: Wanted, say: Callable[[str], None]) -> None:
    """Serve until the process is told to end.

    Args:
        wanted: how.
        say: takes lines for a person, the page's address first.

    Raises:
        ServiceError: folder, port or agent cannot be had.
        ConfigError: ``bench.toml`` does not describe a bench.
        CatalogueError: the catalogue cannot be opened.
    """
    log_to_stderr()
    data = wanted.data.resolve()
    link, commands = _way_to_agent(wanted)
    with _folder(data), _listening(wanted.host, wanted.port) as listener:
        started = _agent_started(wanted, link, data)
        access, token = open_access(data, new=wanted.new_token)
        loopback = wanted.host in LOOPBACK_NAMES
        app = create_app(
            Surroundings(
                data=data,
                access=access,
                link=link,
                engine=_engine(wanted, data),
                logs_here=commands is None or _on_this_machine(commands),
                hosts=LOOPBACK_NAMES if loopback else ("*",),
            )
        )
        host, port = listener.getsockname()[:2]
        say(_address(f"http://{f'[{host}]' if ':' in host else host}:{port}/", token))
        if not loopback:
            say("anyone on the network can reach this address, and nothing is encrypted: put TLS in front of it")
        _run(app, listener)
        if started:
            say(leave_agent(link))


def _address(page: str, token: str | None) -> str:
    if token is None:
        return f"{page} (the token is as before; --new-token makes another)"
    return f"{page}#token={token}"


@contextmanager
def _folder(data: Path) -> Iterator[None]:
    """The data folder, for one service at a time."""
    # The lock is the system's, not the file's presence: a service that was killed leaves none behind.
    try:
        data.mkdir(parents=True, exist_ok=True)
        lock = (data / "service.lock").open("w")
    except OSError as error:
        raise ServiceError(f"{data}: cannot be written to ({error.strerror}); give another --data") from error
    with lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise ServiceError(f"another service works on {data}; end it, or give another --data") from None
        yield


@contextmanager
def _listening(host: str, port: int) -> Iterator[socket.socket]:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        listener = socket.create_server((host, port), family=family)
    except OSError as error:
        words = error.strerror or str(error)
        raise ServiceError(f"{host} port {port}: {words.lower()}; give another --port") from error
    with listener:
        yield listener


def _way_to_agent(wanted: Wanted) -> tuple[AgentLink, str | None]:
    """The way to the agent, and its address; none where no agent was named."""
    if wanted.agent is not None:
        return AgentClient(wanted.agent, _next_port(wanted.agent)), wanted.agent
    if wanted.config is not None:
        agent = load_config(wanted.config).agent
        return AgentClient(agent.commands, agent.samples), agent.commands
    return NoAgent(), None


def _next_port(address: str) -> str:
    try:
        parts = urlsplit(address)
        if parts.scheme != "tcp" or parts.hostname is None or parts.port is None:
            raise ValueError(address)
    except ValueError:
        raise ServiceError(f"--agent {address}: not of the form tcp://HOST:PORT") from None
    return f"tcp://{parts.hostname}:{parts.port + 1}"


def _on_this_machine(address: str) -> bool:
    return not address.startswith("tcp://") or urlsplit(address).hostname in LOOPBACK_NAMES


def _agent_started(wanted: Wanted, link: AgentLink, data: Path) -> bool:
    """Start an agent where one is configured and none answers; whether that was done."""
    if wanted.config is None or wanted.agent is not None:
        return False
    if answers(link):
        _LOG.info("agent_found", extra={"config": str(wanted.config)})
        return False
    start_agent(wanted.config, link, data)
    return True


def _engine(wanted: Wanted, data: Path) -> Callable[[], AbstractAsyncContextManager[Engine]]:
    if wanted.scheduler is None:
        return lambda: local_engine(data)
    address = wanted.scheduler
    return lambda: engine_at(address)


class _Server(uvicorn.Server):
    """Ends at a signal without raising it again: what comes after serving must still be done."""

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        numbers = (signal.SIGINT, signal.SIGTERM)
        before = {number: signal.signal(number, self.handle_exit) for number in numbers}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)


def _run(app: object, listener: socket.socket) -> None:
    # Uvicorn's own lines would write down the token that a browser gives in the websocket's address.
    settings = uvicorn.Config(
        app,  # type: ignore[arg-type]
        log_config=None,
        access_log=False,
        server_header=False,
        timeout_graceful_shutdown=_GRACE,
        ws_max_size=65536,
    )
    server = _Server(settings)
    server.run(sockets=[listener])
    if not server.started:
        raise ServiceError("the service could not start; its log above says why")
