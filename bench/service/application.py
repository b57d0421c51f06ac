"""Web application: routes, access check, errors, static page, and the objects with the same lifetime."""

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, AsyncExitStack, asynccontextmanager, suppress
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

from fastapi import Depends, FastAPI
from fastapi.security import HTTPBearer
from fastapi.staticfiles import StaticFiles
from prometheus_client import CollectorRegistry
from starlette.middleware.trustedhost import TrustedHostMiddleware

from bench.campaigns import CampaignStore, NotificationSender
from bench.catalogue import Catalogue, JobRow, RunRow, locate_catalogue, open_database
from bench.disk import SpaceMonitor
from bench.jobs import JobEngine, JobManager, make_job_view
from bench.live import serialise_message
from bench.log_store import LocalLogs, LogCopier
from bench.oidc import OidcConfig, Provider
from bench.samples import SampleStore
from bench.service import problems
from bench.service.access import Access, Authenticator, PeopleStores
from bench.service.audit import AuditTrail
from bench.service.benches import BenchMaker, BenchSettings, ServedBenches
from bench.service.campaigns import WorkerState
from bench.service.context import ServiceContext
from bench.service.middleware import (
    AccessCheckMiddleware,
    AuditMiddleware,
    BodyLimitMiddleware,
    HeadMiddleware,
    KeptAnswerMiddleware,
    RequestLogMiddleware,
    RequestMetricsMiddleware,
    SecurityHeadersMiddleware,
)
from bench.service.requests import refuse_unknown_parameters
from bench.service.routes import PROTECTED_ROUTERS, PUBLIC_ROUTERS, refuse_unknown_paths
from bench.service.run_registry import RunRegistry
from bench.service.transfer import MAX_UPLOAD_SIZE, remove_leftovers

API = "/api/v1"
PUBLIC_OPERATIONS = (
    f"GET {API}/health",
    f"GET {API}/openapi.json",
    f"POST {API}/session",
    f"GET {API}/session/ways",
    f"GET {API}/session/oidc",
    f"GET {API}/session/oidc/callback",
)
"""Operations that need no sign-in."""
CATALOGUE_PATHS = frozenset(f"{API}/{path}" for path in ("events", "jobs", "methods"))
"""Paths whose answers depend only on the catalogue and the query."""
_BENCH_PARTS = ("", "/channels", "/instruments", "/limits")
STATUS_PATHS = frozenset(
    f"{API}/{path}" for path in ("benches", "runs", *(f"bench{part}" for part in _BENCH_PARTS))
)
"""Paths whose answers depend only on the catalogue, the agents' statuses and the query."""
COMPUTATIONS = frozenset((f"{API}/methods/dry-run", f"{API}/campaigns/plan"))
"""Paths whose POST only computes an answer; nothing of it is recorded."""
LOOPBACK_NAMES = ("127.0.0.1", "localhost", "[::1]", "::1")
PAGE_FOLDER = Path(__file__).parent.parent / "web" / "static"
"""Files of the web page."""


@dataclass(frozen=True)
class AppSettings:
    """Folder, access, benches and engine of the application."""

    data: Path
    """Data folder, absolute."""
    access: Access
    benches: tuple[BenchSettings, ...]
    """Benches with different names; at least one."""
    engine: Callable[[], AbstractAsyncContextManager[JobEngine]]
    hosts: tuple[str, ...] = LOOPBACK_NAMES
    """Accepted host names; `*` for any. Protects the loopback interface against DNS rebinding."""
    oidc: OidcConfig | None = None
    """Provider by which persons sign in; None for local users and tokens only."""
    log_store: str | None = None
    """URL of the store to which logs are copied; None without one."""
    keep_local: float | None = None
    """Days after which a copied log is removed from this machine; None for never."""


def create_app(settings: AppSettings | None = None) -> FastAPI:
    """Create the application.

    Args:
        settings: settings; without them, the application can only return its OpenAPI description.
    """
    app = FastAPI(
        title="mrbench",
        version=version("mrbench"),
        description="Test bench for magnetorheological dampers. SI throughout; times are UTC.",
        openapi_url=f"{API}/openapi.json",
        docs_url=None,  # FastAPI's documentation pages load scripts from other servers
        redoc_url=None,
        lifespan=None if settings is None else lambda app: _run_lifespan(app, settings),
    )
    app.openapi = lambda: _make_openapi(app)  # type: ignore[method-assign]
    problems.install_handlers(app)
    # The middleware that is added last sees a request first.
    app.add_middleware(KeptAnswerMiddleware, catalogue=CATALOGUE_PATHS, status=_list_status_paths(settings))
    app.add_middleware(HeadMiddleware, below="/api/")
    app.add_middleware(BodyLimitMiddleware, paths={f"{API}/logs": MAX_UPLOAD_SIZE})
    app.add_middleware(AccessCheckMiddleware, below=API, public=PUBLIC_OPERATIONS)
    routes = tuple(route for router in PROTECTED_ROUTERS for route in router.routes)
    app.add_middleware(AuditMiddleware, api=API, routes=routes, unrecorded=COMPUTATIONS)
    app.add_middleware(RequestLogMiddleware)
    app.state.request_metrics = CollectorRegistry()
    app.add_middleware(RequestMetricsMiddleware, registry=app.state.request_metrics)
    app.add_middleware(SecurityHeadersMiddleware, api="/api/")
    app.add_middleware(TrustedHostMiddleware, allowed_hosts=list(settings.hosts if settings else ("*",)))
    for router in PUBLIC_ROUTERS:
        app.include_router(router, prefix=API)
    for router in PROTECTED_ROUTERS:
        app.include_router(
            router,
            prefix=API,
            dependencies=[Depends(_BEARER), Depends(refuse_unknown_parameters)],
            responses=problems.RESPONSES,
        )
    refuse_unknown_paths(app, f"{API}/")
    if PAGE_FOLDER.is_dir():
        app.mount("/", StaticFiles(directory=PAGE_FOLDER, html=True), name="page")
    return app


_BEARER = HTTPBearer(auto_error=False, description="token of the bench or of a program")
"""Description of the token for OpenAPI; `AccessCheckMiddleware` checks it, or the cookie of a session."""


def _list_status_paths(settings: AppSettings | None) -> frozenset[str]:
    """Return the paths in `STATUS_PATHS`, and the same parts of the named benches."""
    benches = () if settings is None else settings.benches
    return STATUS_PATHS.union(f"{API}/benches/{bench.name}{part}" for bench in benches for part in _BENCH_PARTS)


@asynccontextmanager
async def _run_lifespan(app: FastAPI, settings: AppSettings) -> AsyncIterator[None]:
    """Run catalogue, engine, agent monitor and scans; they end in reverse order, also after an error."""
    database = await asyncio.to_thread(open_database, locate_catalogue(settings.data))
    await asyncio.to_thread(remove_leftovers, settings.data)
    async with AsyncExitStack() as stack:
        catalogue = Catalogue(database, settings.data)
        stack.callback(catalogue.close)
        engine = await stack.enter_async_context(settings.engine())
        context = app.state.context = _make_context(settings, catalogue, engine)
        stack.push_async_callback(engine.close)
        await engine.start(context.job_manager)
        for bench in context.benches:
            stack.enter_context(bench.monitor)
        stack.enter_context(context.audit)
        stack.enter_context(NotificationSender(context.campaign_store))
        for bench in context.benches:
            stack.enter_context(bench.campaigns)
        if context.log_copier is not None:
            stack.enter_context(context.log_copier)
        stack.push_async_callback(_cancel_task, asyncio.create_task(context.registry.scan_periodically()))
        for bench in context.benches:
            stack.push_async_callback(_cancel_task, asyncio.create_task(bench.live.publish_clock()))
        stack.callback(context.benches.request_end)  # the first to be called: no thread then waits for another
        yield


def _make_context(settings: AppSettings, catalogue: Catalogue, engine: JobEngine) -> ServiceContext:
    """Create the objects of the routes and connect their callbacks; called in the event loop."""

    def on_job_changed(row: JobRow) -> None:
        benches.publish("job", serialise_message("job", make_job_view(row)), row.id)

    async def on_run_changed(row: RunRow) -> None:
        view = (await asyncio.to_thread(context.make_run_views, row))[0]
        benches.publish("run", serialise_message("run", view), row.id)

    local_logs = LocalLogs(catalogue)
    job_manager = JobManager(catalogue, engine, on_job_changed, local_logs.locate)
    audit = AuditTrail(settings.data, {bench.name: bench.link.send for bench in settings.benches})
    registry = RunRegistry(catalogue, job_manager, lambda: benches.find_statuses(), on_run_changed)
    loop = asyncio.get_running_loop()
    worker = WorkerState(engine, loop)
    maker = BenchMaker(catalogue, registry, audit, worker.describe, loop)
    benches = ServedBenches([maker.make(bench) for bench in settings.benches])
    context = ServiceContext(
        Authenticator(settings.access, PeopleStores(catalogue.users, catalogue.tokens, catalogue.sessions)),
        catalogue,
        benches,
        engine,
        job_manager,
        registry,
        SpaceMonitor(settings.data),
        SampleStore(settings.data),
        CampaignStore(catalogue, worker.describe),
        audit,
        local_logs,
        provider=None if settings.oidc is None else Provider(settings.oidc),
        log_copier=_make_copier(settings, catalogue, local_logs),
    )
    return context


def _make_copier(settings: AppSettings, catalogue: Catalogue, local_logs: LocalLogs) -> LogCopier | None:
    if settings.log_store is None:
        return None
    days = settings.keep_local
    remove_old = (lambda: None) if days is None else partial(local_logs.remove_old, days)
    return LogCopier(catalogue, settings.log_store, remove_old)


async def _cancel_task(task: "asyncio.Task[None]") -> None:
    task.cancel()
    with suppress(asyncio.CancelledError):
        await task


def _make_openapi(app: FastAPI) -> dict[str, Any]:
    """Return the OpenAPI description, with the schema of problems, which no route declares as its response."""
    # FastAPI caches the description and returns the same object again, so that the addition is kept.
    if app.openapi_schema is None:
        description = FastAPI.openapi(app)
        schema = problems.Problem.model_json_schema(mode="serialization")
        description["components"]["schemas"]["Problem"] = schema
    return FastAPI.openapi(app)
