"""The web application: routes, access, problems, the page; and what lives as long as it does."""

import asyncio
import logging
from collections.abc import AsyncIterator, Callable
from concurrent.futures import Future
from contextlib import AbstractAsyncContextManager, AsyncExitStack, asynccontextmanager, suppress
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

from fastapi import Depends, FastAPI
from fastapi.security import HTTPAuthorizationCredentials, HTTPBearer
from fastapi.staticfiles import StaticFiles
from starlette.middleware.trustedhost import TrustedHostMiddleware

from bench.agent_protocol import AgentStatus
from bench.catalogue import Catalogue, JobRow, RunRow, make_sqlite_url, open_database
from bench.jobs import JobEngine, JobManager
from bench.service import problems
from bench.service.access import Access
from bench.service.agent_monitor import AgentLink, AgentMonitor
from bench.service.context import Context, ServiceContext
from bench.service.live import LiveBroadcaster, serialise_message
from bench.service.request_log import RequestLogMiddleware
from bench.service.routes import PROTECTED_ROUTERS, PUBLIC_ROUTERS
from bench.service.run_registry import RunRegistry
from bench.service.views import make_job_view

_LOG = logging.getLogger(__name__)
API = "/api/v1"
LOOPBACK_NAMES = ("127.0.0.1", "localhost", "[::1]", "::1")
PAGE_FOLDER = Path(__file__).parent.parent / "web" / "static"
"""The page's files."""


@dataclass(frozen=True)
class AppSettings:
    """What the application is put into."""

    data: Path
    """Data folder, absolute."""
    access: Access
    link: AgentLink
    engine: Callable[[], AbstractAsyncContextManager[JobEngine]]
    has_local_logs: bool = True
    """Whether the agent writes into the data folder."""
    hosts: tuple[str, ...] = LOOPBACK_NAMES
    """Names by which a browser may call; `*` for any. Keeps other sites' names off the loopback interface."""
    database: str | None = None
    """Address of the catalogue; an SQLite file in the data folder by default."""


def create_app(surroundings: AppSettings | None = None) -> FastAPI:
    """The application.

    Args:
        surroundings: what it is put into; without, it can only describe itself.
    """
    app = FastAPI(
        title="mrbench",
        version=version("mrbench"),
        description="Test bench for magnetorheological dampers. SI throughout; times are UTC.",
        openapi_url=f"{API}/openapi.json",
        docs_url=None,  # its pages of documentation load scripts from elsewhere
        redoc_url=None,
        lifespan=None if surroundings is None else lambda app: _run_lifespan(app, surroundings),
    )
    app.openapi = lambda: _make_openapi(app)  # type: ignore[method-assign]
    problems.install_handlers(app)
    app.add_middleware(RequestLogMiddleware)
    app.add_middleware(TrustedHostMiddleware, allowed_hosts=list(surroundings.hosts if surroundings else ("*",)))
    for router in PUBLIC_ROUTERS:
        app.include_router(router, prefix=API)
    for router in PROTECTED_ROUTERS:
        app.include_router(router, prefix=API, dependencies=[Depends(_check_token)], responses=problems.RESPONSES)
    if PAGE_FOLDER.is_dir():
        app.mount("/", StaticFiles(directory=PAGE_FOLDER, html=True), name="page")
    return app


_BEARER = HTTPBearer(auto_error=False, description="the token that `mrbench serve` printed at its first start")


def _check_token(
    context: Context, credentials: Annotated[HTTPAuthorizationCredentials | None, Depends(_BEARER)]
) -> None:
    if credentials is None or not context.access.is_allowed(credentials.credentials):
        raise problems.make_unauthorised()


@asynccontextmanager
async def _run_lifespan(app: FastAPI, surroundings: AppSettings) -> AsyncIterator[None]:
    """Everything that goes on beside the requests; it ends in the opposite order, whatever happens meanwhile."""
    database = await asyncio.to_thread(
        open_database, surroundings.database or make_sqlite_url(surroundings.data / "catalogue.db")
    )
    async with AsyncExitStack() as living:
        catalogue = Catalogue(database, surroundings.data)
        living.callback(catalogue.close)
        engine = await living.enter_async_context(surroundings.engine())
        context = app.state.context = _make_context(surroundings, catalogue, engine)
        living.push_async_callback(engine.close)
        await engine.start(context.job_manager)
        living.enter_context(context.monitor)
        living.push_async_callback(_cancel_task, asyncio.create_task(context.registry.scan_periodically()))
        yield


def _make_context(surroundings: AppSettings, catalogue: Catalogue, engine: JobEngine) -> ServiceContext:
    """What the routes work with, each told of what the others do; called in the event loop."""
    loop, live_messages = asyncio.get_running_loop(), LiveBroadcaster()

    def job_changed(row: JobRow) -> None:
        live_messages.publish("job", serialise_message("job", make_job_view(row)), row.id)

    async def run_changed(row: RunRow) -> None:
        shown = (await asyncio.to_thread(context.make_run_views, row))[0]
        live_messages.publish("run", serialise_message("run", shown), row.id)

    def observed(status: AgentStatus) -> None:
        if not loop.is_closed():
            asyncio.run_coroutine_threadsafe(book.observe(status), loop).add_done_callback(_log_failure)

    keeper = JobManager(catalogue, engine, job_changed)
    watch = AgentMonitor(surroundings.link, live_messages.make_publisher(loop), observed)
    book = RunRegistry(catalogue, keeper, lambda: watch.latest_status, run_changed)
    context = ServiceContext(
        surroundings.access, catalogue, watch, live_messages, engine, keeper, book, surroundings.has_local_logs
    )
    return context


def _log_failure(writing: "Future[None]") -> None:
    """Nobody waits for what a status says of runs: what goes wrong with it would be lost without a word."""
    if not writing.cancelled() and (error := writing.exception()) is not None:
        _LOG.error("status_unused", extra={"why": repr(error)})


async def _cancel_task(task: "asyncio.Task[None]") -> None:
    task.cancel()
    with suppress(asyncio.CancelledError):
        await task


def _make_openapi(app: FastAPI) -> dict[str, Any]:
    """The description with the form of problems, which no route has as its answer."""
    # FastAPI keeps the description that it has made, and gives this very one again: what is added stays.
    if app.openapi_schema is None:
        found = FastAPI.openapi(app)
        form = problems.Problem.model_json_schema(mode="serialization")
        found["components"]["schemas"]["Problem"] = form
    return FastAPI.openapi(app)
