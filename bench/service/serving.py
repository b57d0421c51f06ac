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

from bench.agent_protocol import AgentClient
from bench.config import load_config
from bench.jobs import JobEngine
from bench.log_lines import log_to_stderr
from bench.service.access import open_access
from bench.service.agent_monitor import AgentLink, NoAgent
from bench.service.application import LOOPBACK_NAMES, AppSettings, create_app
from bench.service.errors import ServiceError
from bench.service.processes import (
    connect_engine,
    is_answering,
    shut_down_idle_agent,
    start_agent,
    start_local_engine,
)

_LOG = logging.getLogger(__name__)
_SHUTDOWN_TIMEOUT = 5
"""[s] for open calls at the end."""


@dataclass(frozen=True)
class ServeOptions:
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


def serve(wanted: ServeOptions, say: Callable[[str], None]) -> None:
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
    link, commands = _make_agent_link(wanted)
    with _lock_data_folder(data), _open_listener(wanted.host, wanted.port) as listener:
        started = _start_missing_agent(wanted, link, data)
        access, token = open_access(data, new=wanted.new_token)
        loopback = wanted.host in LOOPBACK_NAMES
        app = create_app(
            AppSettings(
                data=data,
                access=access,
                link=link,
                engine=_choose_engine(wanted, data),
                has_local_logs=commands is None or _is_local(commands),
                hosts=LOOPBACK_NAMES if loopback else ("*",),
            )
        )
        host, port = listener.getsockname()[:2]
        say(_format_address(f"http://{f'[{host}]' if ':' in host else host}:{port}/", token))
        if not loopback:
            say("anyone on the network can reach this address, and nothing is encrypted: put TLS in front of it")
        _run_server(app, listener)
        if started:
            say(shut_down_idle_agent(link))


def _format_address(page: str, token: str | None) -> str:
    if token is None:
        return f"{page} (the token is as before; --new-token makes another)"
    return f"{page}#token={token}"


@contextmanager
def _lock_data_folder(data: Path) -> Iterator[None]:
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
def _open_listener(host: str, port: int) -> Iterator[socket.socket]:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        listener = socket.create_server((host, port), family=family)
    except OSError as error:
        words = error.strerror or str(error)
        raise ServiceError(f"{host} port {port}: {words.lower()}; give another --port") from error
    with listener:
        yield listener


def _make_agent_link(wanted: ServeOptions) -> tuple[AgentLink, str | None]:
    """The way to the agent, and its address; none where no agent was named."""
    if wanted.agent is not None:
        return AgentClient(wanted.agent, _make_sample_address(wanted.agent)), wanted.agent
    if wanted.config is not None:
        agent = load_config(wanted.config).agent
        return AgentClient(agent.commands, agent.samples), agent.commands
    return NoAgent(), None


def _make_sample_address(address: str) -> str:
    try:
        parts = urlsplit(address)
        if parts.scheme != "tcp" or parts.hostname is None or parts.port is None:
            raise ValueError(address)
    except ValueError:
        raise ServiceError(f"--agent {address}: not of the form tcp://HOST:PORT") from None
    return f"tcp://{parts.hostname}:{parts.port + 1}"


def _is_local(address: str) -> bool:
    return not address.startswith("tcp://") or urlsplit(address).hostname in LOOPBACK_NAMES


def _start_missing_agent(wanted: ServeOptions, link: AgentLink, data: Path) -> bool:
    """Start an agent where one is configured and none answers; whether that was done."""
    if wanted.config is None or wanted.agent is not None:
        return False
    if is_answering(link):
        _LOG.info("agent_found", extra={"config": str(wanted.config)})
        return False
    start_agent(wanted.config, link, data)
    return True


def _choose_engine(wanted: ServeOptions, data: Path) -> Callable[[], AbstractAsyncContextManager[JobEngine]]:
    if wanted.scheduler is None:
        return lambda: start_local_engine(data)
    address = wanted.scheduler
    return lambda: connect_engine(address)


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


def _run_server(app: object, listener: socket.socket) -> None:
    # Uvicorn's own lines would write down the token that a browser gives in the websocket's address.
    settings = uvicorn.Config(
        app,  # type: ignore[arg-type]
        log_config=None,
        access_log=False,
        server_header=False,
        timeout_graceful_shutdown=_SHUTDOWN_TIMEOUT,
        ws_max_size=65536,
    )
    server = _Server(settings)
    server.run(sockets=[listener])
    if not server.started:
        raise ServiceError("the service could not start; its log above says why")
