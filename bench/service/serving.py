"""Start of the service: data folder, port, agent, token, web server."""

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
"""Time for open requests to finish at shutdown [s]."""


@dataclass(frozen=True)
class ServeOptions:
    """Options of the service."""

    data: Path
    host: str = "127.0.0.1"
    port: int = 8600
    """Port; 0 for any free one."""
    config: Path | None = None
    """``bench.toml``; an agent is started with it if none answers."""
    agent: str | None = None
    """Address of the agent's command socket; the agent publishes at the next port."""
    scheduler: str | None = None
    new_token: bool = False


def serve(options: ServeOptions, print_line: Callable[[str], None]) -> None:
    """Serve until the process receives a signal.

    Args:
        options: options of the service.
        print_line: receives lines for a person; the first contains the address of the page.

    Raises:
        ServiceError: the data folder, the port or the agent is not available.
        ConfigError: ``bench.toml`` is invalid.
        CatalogueError: the catalogue cannot be opened.
    """
    log_to_stderr()
    data = options.data.resolve()
    link, commands = _make_agent_link(options)
    with _lock_data_folder(data), _open_listener(options.host, options.port) as listener:
        started = _start_missing_agent(options, link, data)
        access, token = open_access(data, new=options.new_token)
        loopback = options.host in LOOPBACK_NAMES
        app = create_app(
            AppSettings(
                data=data,
                access=access,
                link=link,
                engine=_choose_engine(options, data),
                has_local_logs=commands is None or _is_local(commands),
                hosts=LOOPBACK_NAMES if loopback else ("*",),
            )
        )
        host, port = listener.getsockname()[:2]
        print_line(_format_address(f"http://{f'[{host}]' if ':' in host else host}:{port}/", token))
        if not loopback:
            print_line("this address is open to the network and not encrypted; put a TLS proxy in front of it")
        _run_server(app, listener)
        if started:
            print_line(shut_down_idle_agent(link))


def _format_address(page: str, token: str | None) -> str:
    if token is None:
        return f"{page} (the token is unchanged; --new-token creates a new one)"
    return f"{page}#token={token}"


@contextmanager
def _lock_data_folder(data: Path) -> Iterator[None]:
    """Lock the data folder for one service at a time."""
    # The operating system holds the lock, so that it is released when a service is killed.
    try:
        data.mkdir(parents=True, exist_ok=True)
        lock = (data / "service.lock").open("w")
    except OSError as error:
        raise ServiceError(f"{data}: cannot be written to ({error.strerror}); use another --data") from error
    with lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise ServiceError(f"another service uses {data}; end it, or use another --data") from None
        yield


@contextmanager
def _open_listener(host: str, port: int) -> Iterator[socket.socket]:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        listener = socket.create_server((host, port), family=family)
    except OSError as error:
        reason = error.strerror or str(error)
        raise ServiceError(f"{host} port {port}: {reason.lower()}; use another --port") from error
    with listener:
        yield listener


def _make_agent_link(options: ServeOptions) -> tuple[AgentLink, str | None]:
    """Return the connection to the agent and its address; the address is None without an agent."""
    if options.agent is not None:
        return AgentClient(options.agent, _make_sample_address(options.agent)), options.agent
    if options.config is not None:
        agent = load_config(options.config).agent
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


def _start_missing_agent(options: ServeOptions, link: AgentLink, data: Path) -> bool:
    """Start an agent if one is configured and none answers; return whether it was started."""
    if options.config is None or options.agent is not None:
        return False
    if is_answering(link):
        _LOG.info("agent_found", extra={"config": str(options.config)})
        return False
    start_agent(options.config, link, data)
    return True


def _choose_engine(options: ServeOptions, data: Path) -> Callable[[], AbstractAsyncContextManager[JobEngine]]:
    if options.scheduler is None:
        return lambda: start_local_engine(data)
    address = options.scheduler
    return lambda: connect_engine(address)


class _Server(uvicorn.Server):
    """Web server that ends at a signal without raising it again, so that the caller can clean up."""

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
    # Uvicorn's own log would contain the token that a browser sends in the URL of the websocket.
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
        raise ServiceError("the service could not start; see its log above")
