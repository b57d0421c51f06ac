"""Start of the service: data folder, port, agent, token, web server."""

import signal
import socket
import ssl
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractAsyncContextManager, ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import uvicorn

from bench.catalogue import keep_address, locate_catalogue, open_database
from bench.config import write_benches
from bench.folder_lock import hold_lock
from bench.jobs import JobEngine, get_tls_file, locate_scheduler
from bench.log_lines import log_to_stderr
from bench.log_store import find_store, keep_store_url
from bench.oidc import load_oidc_config
from bench.service.access import PLAIN_TOKEN_FILE, open_access, save_token
from bench.service.application import LOOPBACK_NAMES, AppSettings, create_app
from bench.service.bench_agents import BenchAgent, BenchPlace, make_agents
from bench.service.errors import ServiceError
from bench.service.processes import connect_engine, start_local_engine

_SWITCH_INTERVAL = 2e-4
"""Time after which a computing thread yields the interpreter to the one that answers requests [s]."""
_SHUTDOWN_TIMEOUT = 5
"""Time for open requests to finish at shutdown [s]."""


class TlsFiles(NamedTuple):
    """Files by which the service answers HTTPS."""

    certificate: Path
    """Certificate chain, PEM."""
    key: Path
    """Its private key, PEM, without a password."""


@dataclass(frozen=True)
class ServeOptions:
    """Options of the service."""

    data: Path
    host: str = "127.0.0.1"
    port: int = 8600
    """Port; 0 for any free one."""
    benches: tuple[BenchPlace, ...] = (BenchPlace(),)
    """Benches with different names; at least one."""
    start_agent: bool = True
    """Start the agent of a ``bench.toml`` if none answers, and again when it dies."""
    scheduler: str | None = None
    new_token: bool = False
    scheduler_tls: Path | None = None
    """TLS file of the scheduler; by default that in the data folder."""
    allow_plain_scheduler: bool = False
    """Accept a scheduler without TLS beyond the loopback interface."""
    tls: TlsFiles | None = None
    """Files of HTTPS; without them, the service answers plain HTTP."""
    catalogue: str | None = None
    """URL of the catalogue's database, which the data folder keeps; by default that of its last start."""
    log_store: str | None = None
    """URL of the store for copies of the logs, which the data folder keeps; by default that of its last start."""
    keep_local: float | None = None
    """Days after which a copied log is removed from this machine; None for never."""
    oidc: Path | None = None
    """``oidc.toml`` of the provider by which persons sign in."""
    is_terminal: bool = False
    """True if the printed lines are shown on a terminal and kept nowhere: only then is the token printed."""


def serve(options: ServeOptions, print_line: Callable[[str], None]) -> None:
    """Serve until the process receives a signal.

    Args:
        options: options of the service.
        print_line: receives lines for a person; the first contains the address of the page.

    Raises:
        ServiceError: the data folder, the port or the agent is not available.
        WorkerError: the address of the scheduler is not valid, or is refused because it has no TLS.
        SecretFileError: a file with a secret is missing, or other users may read it.
        ConfigError: a ``bench.toml``, ``oidc.toml`` or the address of an agent is invalid.
        CatalogueError: the catalogue cannot be opened, or another one is in the data folder.
        LogStoreError: the address of the log store is not valid.
    """
    log_to_stderr()
    if options.tls is not None:
        check_tls(options.tls)
    oidc = None if options.oidc is None else load_oidc_config(options.oidc)
    data = options.data.resolve()
    agents = make_agents(options.benches)
    with _lock_data_folder(data), _open_listener(options.host, options.port) as listener:
        _prepare_catalogue(data, options.catalogue)
        if options.log_store is not None:
            keep_store_url(data, options.log_store)
        _supervise_agents(agents, data, is_started=options.start_agent)
        write_benches(data, {agent.name: str(agent.place) for agent in agents})
        # Until now a client is refused at once; it would wait in vain for as long as the agent takes to start.
        with _explain_address_error(options.host, options.port):
            listener.listen()
        access, token = open_access(data, new=options.new_token)
        loopback = options.host in LOOPBACK_NAMES
        app = create_app(
            AppSettings(
                data=data,
                access=access,
                benches=tuple(agent.make_settings() for agent in agents),
                engine=_choose_engine(options, data),
                hosts=LOOPBACK_NAMES if loopback else ("*",),
                oidc=oidc,
                log_store=find_store(data),
                keep_local=options.keep_local,
            )
        )
        host, port = listener.getsockname()[:2]
        page = f"{'https' if options.tls else 'http'}://{f'[{host}]' if ':' in host else host}:{port}/"
        print_line(_format_address(page, token, data, is_terminal=options.is_terminal))
        if not loopback and options.tls is None:
            print_line("this address is open to the network and not encrypted; give --tls-cert and --tls-key")
        with ExitStack() as supervision:
            for agent in agents:
                supervision.enter_context(agent.supervision)
            _run_server(app, listener, options.tls)
        for agent in agents:
            if (state := agent.shut_down_if_started()) is not None:
                print_line(state if len(agents) == 1 else f"{agent.name}: {state}")


def _supervise_agents(agents: Sequence[BenchAgent], data: Path, *, is_started: bool) -> None:
    """Prepare the supervision of all agents at once, because each one that is silent costs a second."""
    is_only = len(agents) == 1
    with ThreadPoolExecutor(len(agents)) as threads:
        made = [threads.submit(agent.supervise, data, is_started=is_started, is_only=is_only) for agent in agents]
    for one in made:
        one.result()


def _prepare_catalogue(data: Path, url: str | None) -> None:
    """Open the catalogue once, so that a failure ends the start with one line and before the agent starts.

    Raises:
        CatalogueError: the catalogue cannot be opened, or another one is in the data folder.
    """
    if url is not None:
        keep_address(data, url)
    open_database(locate_catalogue(data)).dispose()


def _format_address(page: str, token: str | None, data: Path, *, is_terminal: bool) -> str:
    """Return the line with the address of the page; a new token without a terminal is written to a file."""
    if token is not None and is_terminal:
        return f"{page}#token={token}"
    # What is printed without a terminal ends in log files, which others may read.
    path = data / PLAIN_TOKEN_FILE if token is None else save_token(data, token)
    place = f"; it is in {path}" if path.is_file() else ""
    state = "unchanged; --new-token creates a new one" if token is None else "new"
    return f"{page} (the token is {state}{place})"


@contextmanager
def _lock_data_folder(data: Path) -> Iterator[None]:
    """Lock the data folder for one service at a time."""
    with ExitStack() as stack:
        try:
            data.mkdir(parents=True, exist_ok=True)
            is_free = stack.enter_context(hold_lock(data))
        except OSError as error:
            raise ServiceError(f"{data}: cannot be written to ({error.strerror}); use another --data") from error
        if not is_free:
            raise ServiceError(
                f"another service uses {data}, or a transfer of its catalogue; end it, or use another --data"
            )
        yield


@contextmanager
def _open_listener(host: str, port: int) -> Iterator[socket.socket]:
    """Reserve an address without listening there yet."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family, socket.SOCK_STREAM) as listener:
        # The connections of a killed service may still be closing.
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if family == socket.AF_INET6:
            listener.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
        with _explain_address_error(host, port):
            listener.bind((host, port))
        yield listener


@contextmanager
def _explain_address_error(host: str, port: int) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        raise ServiceError(f"{host} port {port}: {reason.lower()}; use another --port") from error


def _choose_engine(options: ServeOptions, data: Path) -> Callable[[], AbstractAsyncContextManager[JobEngine]]:
    if options.scheduler is None:
        return lambda: start_local_engine(data)
    tls_file = options.scheduler_tls or get_tls_file(data)
    location = locate_scheduler(options.scheduler, tls_file, allow_plain=options.allow_plain_scheduler)
    return lambda: connect_engine(location)


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


def check_tls(files: TlsFiles) -> None:
    """Check that a certificate and its key can be used, before anything is started.

    Raises:
        ServiceError: a file cannot be read, or they do not belong together.
    """
    try:
        # Without this, the library would ask for a password on the terminal.
        ssl.create_default_context(ssl.Purpose.CLIENT_AUTH).load_cert_chain(*files, password=lambda: b"")
    except (OSError, ssl.SSLError) as error:
        reason = (error.strerror or str(error)) if isinstance(error, OSError) else str(error)
        raise ServiceError(
            f"{files.certificate} and {files.key} cannot be used for TLS ({reason}); give a certificate chain and "
            "its key without a password, both PEM"
        ) from error


def _run_server(app: object, listener: socket.socket, tls: TlsFiles | None) -> None:
    # Uvicorn's own log would contain the token that a browser sends in the URL of the websocket.
    sys.setswitchinterval(_SWITCH_INTERVAL)
    settings = uvicorn.Config(
        app,  # type: ignore[arg-type]
        log_config=None,
        access_log=False,
        server_header=False,
        timeout_graceful_shutdown=_SHUTDOWN_TIMEOUT,
        ws_max_size=65536,
        ssl_certfile=tls.certificate if tls else None,
        ssl_keyfile=tls.key if tls else None,
        ws_per_message_deflate=False,  # samples hardly shrink, and each listener would cost a compression
    )
    server = _Server(settings)
    server.run(sockets=[listener])
    if not server.started:
        raise ServiceError("the service could not start; see its log above")
