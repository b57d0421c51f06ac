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

from bench.agent.messages import AgentStatus
from bench.catalogue.catalogue import Catalogue
from bench.catalogue.database import open_database, sqlite_url
from bench.catalogue.models import JobRow, RunRow
from bench.jobs.engine import Engine
from bench.jobs.keeper import JobKeeper
from bench.service import problems
from bench.service.access import Access
from bench.service.agent_watch import AgentLink, AgentWatch
from bench.service.desk import AtDesk, Desk
from bench.service.live import Live, as_text
from bench.service.request_log import RequestLog
from bench.service.routes import jobs, live, methods, rig, runs
from bench.service.run_book import RunBook
from bench.service.views import job_view

_LOG = logging.getLogger(__name__)
API = "/api/v1"
LOOPBACK_NAMES = ("127.0.0.1", "localhost", "[::1]", "::1")
PAGE = Path(__file__).parent.parent / "web" / "static"
"""The page's files."""


@dataclass(frozen=True)
class Surroundings:
    """What the application is put into."""

    data: Path
    """Data folder, absolute."""
    access: Access
    link: AgentLink
    engine: Callable[[], AbstractAsyncContextManager[Engine]]
    logs_here: bool = True
    """Whether the agent writes into the data folder."""
    hosts: tuple[str, ...] = LOOPBACK_NAMES
    """Names by which a browser may call; `*` for any. Keeps other sites' names off the loopback interface."""
    database: str | None = None
    """Address of the catalogue; an SQLite file in the data folder by default."""


def create_app(surroundings: Surroundings | None = None) -> FastAPI:
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
        lifespan=None if surroundings is None else lambda app: _life(app, surroundings),
    )
    app.openapi = lambda: _described(app)  # type: ignore[method-assign]
    problems.install(app)
    app.add_middleware(RequestLog)
    app.add_middleware(TrustedHostMiddleware, allowed_hosts=list(surroundings.hosts if surroundings else ("*",)))
    app.include_router(rig.open_to_all, prefix=API)
    app.include_router(live.router, prefix=API)
    for subject in (rig, methods, runs, jobs):
        app.include_router(
            subject.router, prefix=API, dependencies=[Depends(_with_token)], responses=problems.RESPONSES
        )
    if PAGE.is_dir():
        app.mount("/", StaticFiles(directory=PAGE, html=True), name="page")
    return app


_BEARER = HTTPBearer(auto_error=False, description="the token that `mrbench serve` printed at its first start")


def _with_token(
    desk: AtDesk, credentials: Annotated[HTTPAuthorizationCredentials | None, Depends(_BEARER)]
) -> None:
    if credentials is None or not desk.access.allows(credentials.credentials):
        raise problems.unauthorised()


@asynccontextmanager
async def _life(app: FastAPI, surroundings: Surroundings) -> AsyncIterator[None]:
    """Everything that goes on beside the requests; it ends in the opposite order, whatever happens meanwhile."""
    database = await asyncio.to_thread(
        open_database, surroundings.database or sqlite_url(surroundings.data / "catalogue.db")
    )
    async with AsyncExitStack() as living:
        catalogue = Catalogue(database, surroundings.data)
        living.callback(catalogue.close)
        engine = await living.enter_async_context(surroundings.engine())
        desk = app.state.desk = _put_together(surroundings, catalogue, engine)
        living.push_async_callback(engine.close)
        await engine.start(desk.keeper)
        living.enter_context(desk.watch)
        living.push_async_callback(_ended, asyncio.create_task(desk.book.scan_on()))
        yield


def _put_together(surroundings: Surroundings, catalogue: Catalogue, engine: Engine) -> Desk:
    """What the routes work with, each told of what the others do; called in the event loop."""
    loop, live_messages = asyncio.get_running_loop(), Live()

    def job_changed(row: JobRow) -> None:
        live_messages.publish("job", as_text("job", job_view(row)), row.id)

    async def run_changed(row: RunRow) -> None:
        shown = (await asyncio.to_thread(desk.shown, row))[0]
        live_messages.publish("run", as_text("run", shown), row.id)

    def observed(status: AgentStatus) -> None:
        if not loop.is_closed():
            asyncio.run_coroutine_threadsafe(book.observe(status), loop).add_done_callback(_told_if_failed)

    keeper = JobKeeper(catalogue, engine, job_changed)
    watch = AgentWatch(surroundings.link, live_messages.publisher(loop), observed)
    book = RunBook(catalogue, keeper, lambda: watch.latest, run_changed)
    desk = Desk(surroundings.access, catalogue, watch, live_messages, engine, keeper, book, surroundings.logs_here)
    return desk


def _told_if_failed(writing: "Future[None]") -> None:
    """Nobody waits for what a status says of runs: what goes wrong with it would be lost without a word."""
    if not writing.cancelled() and (error := writing.exception()) is not None:
        _LOG.error("status_unused", extra={"why": repr(error)})


async def _ended(task: "asyncio.Task[None]") -> None:
    task.cancel()
    with suppress(asyncio.CancelledError):
        await task


def _described(app: FastAPI) -> dict[str, Any]:
    """The description with the form of problems, which no route has as its answer."""
    # FastAPI keeps the description that it has made, and gives this very one again: what is added stays.
    if app.openapi_schema is None:
        found = FastAPI.openapi(app)
        form = problems.Problem.model_json_schema(mode="serialization")
        found["components"]["schemas"]["Problem"] = form
    return FastAPI.openapi(app)
