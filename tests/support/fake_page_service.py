"""Fake service for the web page, with a simple fake bench."""

import asyncio
import contextlib
import math
import socket
import sys
import threading
import time
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import uvicorn
from fastapi import APIRouter, FastAPI, Form, Request, Response, UploadFile, WebSocket, WebSocketDisconnect
from fastapi.responses import FileResponse, HTMLResponse, JSONResponse
from fastapi.staticfiles import StaticFiles

from bench.errors import MethodError
from bench.live import Channel, LiveBatch, describe_channels
from bench.methods import Method, compile_method, compute_envelope, load_method, parse_method
from bench.service.routes.planning.previews import make_preview
from tests.support.fake_batches import FakeBatches, batch_routes
from tests.support.fake_campaigns import FakeCampaigns, campaign_routes
from tests.support.fake_certificates import add_certificate_routes
from tests.support.fake_comparison import comparison_routes
from tests.support.fake_people import COOKIE, TOKEN, FakePeople, people_routes
from tests.support.fake_recording import recording_routes
from tests.support.fake_results import MADE, Records, analysis_routes, make_summary, record_routes
from tests.support.fake_signatures import FakeTrail, add_audit_routes, signature_routes
from tests.support.fake_specimens import add_history, specimen_routes

STATIC = Path(__file__).parents[2] / "bench" / "web" / "static"
FIT = Path(__file__).parents[1] / "contracts" / "documents_47f8566" / "fit.json"
OPENAPI = Path(__file__).parents[2] / "docs" / "reference" / "openapi.json"
REPORT = "<!doctype html><html lang='en'><title>Report</title><h1>Damper report</h1><p>Simulated.</p></html>"
SILENCE = "the rig agent at tcp://127.0.0.1:8700 did not answer within 1 s; is `mrbench rig` up?"
REFUSAL = "lvdt: not connected for 3.2 s; plug it in and start again"
CLAMPED = "a specimen is clamped, and homing would drive it into its ends; unclamp it and call unmount first"
BAD_CELL = "bad.csv, row 2, column force_n: 'much' is not a number"
HASH = "5f" * 32
RATE = 1000
BATCH = 40
CHANNELS = (
    Channel("displacement", "m"),
    Channel("velocity", "m/s"),
    Channel("force", "N"),
    Channel("coil_drive", "V"),
    Channel("coil_current", "A"),
    Channel("temperature", "degC"),
)
PAUSE = "at checkpoint 10mm_1Hz, in 4 s"
CHECKPOINT = "10mm_1Hz"
WAITING = "waiting for bench left, which this service does not have: 1"
OVERDUE = "coil_voltage: calibration overdue since 2025-02-20 (certificate E-77 of Testo Industrial Services)"
TRIP = "load cell: force 1 523.4 N exceeds the specimen's limit of 1 500 N; lower the stroke or the drive"
METHODS = [
    {
        "name": name,
        "title": title,
        "duration_s": duration,
        "drive_kind": "coil_v",
        "checkpoints": [],
        "version": 1,
        "source": "included",
        "usable": True,
        "obstacle": "",
        "sha256": HASH,
        "created": None,
        "approved": None,
        "approved_by": "",
    }
    for name, title, duration in (
        ("identification", "Strokes for an identification", 162.0),
        ("paper_sines", "Six voltages on a 10 mm sine at 1 Hz", 602.5),
        ("quick", "Short look: three voltages", 14.0),
    )
]


def instrument(name: str, driver: str, address: str, **more: Any) -> dict[str, Any]:
    """Return the status of one instrument."""
    healthy = {
        "connected": True, "received": 1_234_567, "lost": 0, "corrupted": 0, "resynchronised": 0, "age_s": 0.0021,
        "clock_error_bound_s": 1.8e-5, "message": "",
    }  # fmt: skip
    return {"name": name, "driver": driver, "address": address} | healthy | more


LIMITS = [
    {"quantity": "force", "action": "controlled_stop", "value": 1500.0},
    {"quantity": "force", "action": "trip", "value": 1875.0},
    {"quantity": "displacement", "action": "controlled_stop", "value": 0.02625},
    {"quantity": "displacement", "action": "trip", "value": 0.055},
    {"quantity": "temperature", "action": "indicate", "value": 60.0},
]
INSTRUMENTS = [
    instrument("actuator", "canopen", "socketcand://127.0.0.1:29536/can0 node 5", age_s=0.004),
    instrument("load_cell", "serial", "/dev/pts/3", lost=12, corrupted=2, resynchronised=1),
    instrument("lvdt", "serial", "/dev/pts/4"),
    instrument("coil_amplifier", "modbus_tcp", "127.0.0.1:1502 unit 1", received=40_211, clock_error_bound_s=None),
    instrument("thermometer", "modbus_rtu", "/dev/pts/5 unit 2", connected=False, age_s=83.0,
               clock_error_bound_s=None, message="no reply for 83 s; is it powered?"),
]  # fmt: skip


def fit_job(run_id: str, state: str, **more: Any) -> dict[str, Any]:
    """Return a job of a run."""
    return {
        "id": f"job-{run_id}", "run": run_id, "kind": "identify", "state": state, "activity": "", "attempts": 1,
        "error": "", "settings": {}, "created": "2025-03-04T09:20:00Z", "started": None, "finished": None,
        "rmse_n": None, "noise_floor_n": None, "result": "", "stage": "", "fraction": None, "position": None,
        "retries": [], "version": "", "diagnosis": None,
    } | more  # fmt: skip


def run(number: int, outcome: str | None, **more: Any) -> dict[str, Any]:
    """Return a run of the list."""
    return {
        "id": f"run-{number}", "method": "quick", "specimen": "MR-0042", "operator": "A. Meyer", "bench": "bench",
        "source": "run", "started": f"2025-03-04T09:{10 + number}:30Z", "duration_s": 14.0, "state": "ended",
        "ending": None, "outcome": outcome, "reason": "", "log": "", "progress": None, "rmse_n": None,
        "noise_floor_n": None, "result": "", "jobs": [], "continues": None, "log_sha256": None, "integrity": None,
        "lost": {}, "alarms": [], "calibration_overdue": [], "failed_checks": [],
        "tags": [], "trashed": None, "method_version": None, "method_sha256": None,
        "log_bytes": None,
        "diagnosis": None,
    } | more  # fmt: skip


def done_jobs(run_id: str, found: dict[str, Any]) -> list[dict[str, Any]]:
    """Return a fit, a diagnosis and a prediction that are done."""
    ended = {"finished": "2025-03-04T09:22:00Z"}
    return [
        fit_job(run_id, "done", **found, **ended),
        fit_job(run_id, "done", id=f"diagnosis-{run_id}", kind="diagnose", **ended),
        fit_job(
            run_id, "done", id=f"prediction-{run_id}", kind="predict", settings={"model": "job-run-7"}, **ended
        ),
    ]


class FakeBench:
    """State of the fake bench; all requests that change something are kept in ``posted``."""

    def __init__(self) -> None:
        self.posted: list[tuple[str, Any]] = []
        self.searches: list[dict[str, str]] = []
        self.outbox: list[dict[str, Any]] = []
        self.events: list[dict[str, Any]] = []
        self.methods: dict[str, Method] = {}
        self.state = "idle"
        self.trip = ""
        self.run: dict[str, Any] | None = None
        self.reference_state = "homed"
        self.step: dict[str, Any] | None = None
        self.refusals = 1
        self.silent = False
        self.last_status: dict[str, Any] | None = None
        self.over = False
        found = {"rmse_n": 1.31, "noise_floor_n": 1.26, "result": "converged"}
        activity = "identify: refine, start 3 of 8"
        self.runs = {
            "run-3": run(3, "lossy", reason="12 samples of force were lost", ending="stopped", log_sha256=HASH,
                         calibration_overdue=[OVERDUE],
                         jobs=[fit_job("run-3", "failed", error="the worker was killed")]),
            "run-2": run(2, "clean", log_sha256=HASH, jobs=[fit_job("run-2", "running", activity=activity)]),
            "run-1": run(1, "clean", jobs=done_jobs("run-1", found), log_sha256=HASH,
                         diagnosis=make_summary("diagnosis-run-1"), **found),
            "run-0": run(0, None, state="truncated", duration_s=None, reason="the log has no end"),
        }  # fmt: skip
        self.records = Records(self.runs)
        self.people, self.trail = FakePeople(), FakeTrail()
        self.approvals: dict[tuple[str, int], dict[str, Any]] = {}
        self.began, self.began_utc = time.monotonic(), time.time()

    def record_event(self, kind: str, text: str) -> dict[str, Any]:
        """Store an event that happens now; return it as listeners get it."""
        stored = {"id": len(self.events) + 1, "run": None, "bench": "bench", "kind": kind, "text": text}
        self.events.append(stored | {"at": datetime.now(UTC).isoformat(), "time_s": None})
        live = {name: value for name, value in self.events[-1].items() if name != "time_s"}
        return live | {"time_ns": time.monotonic_ns()}

    def status(self) -> dict[str, Any]:
        """Return the status of the agent as it is published."""
        return {
            "state": self.state, "utc_s": time.time(), "trip": self.trip, "run": self.run, "finished": [],
            "instruments": INSTRUMENTS,
            "warnings": ["no real-time priority: the loop runs at normal priority; set RLIMIT_RTPRIO"],
            "limits": LIMITS, "travel_m": (-0.06, 0.06), "drive_kind": "coil_v", "drive_unit": "V",
            "reference_state": self.reference_state, "step": self.step,
        }  # fmt: skip

    def begin(self, wanted: dict[str, Any]) -> dict[str, Any]:
        """Start a run that does not end."""
        known = {"id": "run-4", "started": "2025-03-04T09:30:00Z", **wanted}
        self.run = known | {
            "log": "run-4.mcap", "duration_s": 14.0, "elapsed_s": 5.0, "segment": "sine_10mm_1Hz", "outcome": None,
            "reason": "", "lost": {}, "cycle": 3, "cycles": 10,
        }  # fmt: skip
        self.state = "running"
        self.runs["run-4"] = run(4, None, state="running", **known)
        return self.runs["run-4"]

    def samples(self, first: int) -> LiveBatch:
        """Return a batch of samples: a sine of 10 mm at 1.5 Hz, and a force with a hysteresis loop."""
        times = [(first + k) / RATE for k in range(BATCH)]
        omega = 2 * math.pi * 1.5
        displacement = [0.01 * math.sin(omega * t) for t in times]
        velocity = [0.01 * omega * math.cos(omega * t) for t in times]
        drive = [0.1 * (int(t / 4) % 6) for t in times]
        force = [
            (60 + 900 * u) * math.tanh((v + 8 * x) / 0.02) + (900 + 2000 * u) * v
            for x, v, u in zip(displacement, velocity, drive, strict=True)
        ]
        current = [u / 5 for u in drive]
        # A slow instrument has values only in some samples.
        temperature = [24 + 0.05 * t if not k % BATCH else math.nan for k, t in enumerate(times)]
        values = np.array([displacement, velocity, force, drive, current, temperature], np.float32)
        utc_s = self.began_utc + times[0]
        return LiveBatch(first // BATCH, utc_s, 1 / RATE, CHANNELS, values)


def problem(status: int, title: str, detail: str, name: str = "", retry_after: int | None = None) -> JSONResponse:
    """Return an error in the form of the service."""
    kind = f"urn:mrbench:problem:{name}" if name else "about:blank"
    content = {"type": kind, "title": title, "status": status, "detail": detail}
    headers = {} if retry_after is None else {"Retry-After": str(retry_after)}
    return JSONResponse(content, status_code=status, headers=headers, media_type="application/problem+json")


def find_refusal(bench: FakeBench, request: Request) -> JSONResponse | None:
    """Return why a request is refused: without sign-in, or with a cookie that another site may have used."""
    operation = f"{request.method} {request.url.path}"
    is_sign_in = operation in ("POST /api/v1/session", "GET /api/v1/session/ways")
    if not request.url.path.startswith("/api/") or is_sign_in:
        return None
    session = bench.people.identify(request)
    if session is None:
        return problem(401, "Not signed in", "sign in on the page")
    is_from_page = "authorization" in request.headers or request.headers.get("x-csrf-token") == session["csrf"]
    if request.method in ("GET", "HEAD") or is_from_page:
        return None
    return problem(403, "The request may come from another site", "send X-CSRF-Token", "csrf")


def application(bench: FakeBench) -> FastAPI:
    """Create the application with the routes that the page uses."""
    app = FastAPI()

    @app.middleware("http")
    async def authorise(request: Request, call_next: Any) -> Any:
        refusal = find_refusal(bench, request)
        if refusal is not None:
            return refusal
        path = request.url.path.removeprefix("/api/v1/")
        if request.method != "GET" and path != "session":
            bench.posted.append((path, (await request.body()).decode()))
        return await call_next(request)

    for routes in (
        rig_routes,
        list_routes,
        method_routes,
        run_routes,
        run_control_routes,
        result_routes,
        upload_routes,
        live_routes,
        specimen_routes,
    ):
        app.include_router(routes(bench), prefix="/api/v1")
    others = (
        recording_routes(),
        comparison_routes(),
        batch_routes(FakeBatches(bench.runs)),
        analysis_routes(),
        record_routes(bench.records, problem),
        campaign_routes(FakeCampaigns()),
        people_routes(bench.people, problem),
        signature_routes(bench.people, bench.trail, problem),
        approval_routes(bench),
    )
    for other in others:
        app.include_router(other, prefix="/api/v1")
    add_certificate_routes(app, FIT)
    add_audit_routes(app, bench.trail)
    app.mount("/", StaticFiles(directory=STATIC, html=True))
    return app


def rig_routes(bench: FakeBench) -> APIRouter:
    """Create the routes of agent and methods; ``silence`` exists for tests and disconnects the agent."""
    router = APIRouter()

    @router.get("/bench")
    async def agent() -> Any:
        return problem(503, "The rig agent does not answer", SILENCE) if bench.silent else bench.status()

    @router.get("/openapi.json")
    async def describe_interface() -> Any:
        return FileResponse(OPENAPI)

    @router.get("/health")
    async def health() -> Any:
        agent = SILENCE if bench.silent else "ok"
        return {
            "version": "0.1.0",
            "agent": agent,
            "worker": "ok",
            "disk": "ok",
            "queue": "empty",
            "audit": "ok",
            "clocks": "ok",
            "campaigns": WAITING,
            "log_store": "ok",
            "calibration": OVERDUE,
        }

    @router.post("/bench/reset")
    async def reset() -> Any:
        bench.state, bench.trip = "idle", ""
        return bench.status()

    @router.post("/bench/stop")
    async def stop() -> Any:
        bench.state, bench.trip, bench.run = "tripped", TRIP, None
        return bench.status()

    @router.post("/bench/abort")
    async def abort() -> Any:
        bench.state, bench.trip, bench.run = "tripped", "aborted on request", None
        return bench.status()

    @router.post("/bench/prepare")
    async def prepare(wanted: dict[str, Any]) -> Any:
        if wanted["step"] == "home" and bench.reference_state == "mounted":
            return problem(409, "Not possible", CLAMPED)
        bench.reference_state = {"mount": "mounted"}.get(wanted["step"], bench.reference_state)
        bench.step = {"step": wanted["step"], "outcome": "done", "message": f"{wanted['step']} is done"}
        return bench.status()

    @router.post("/silence")
    async def disconnect_agent() -> Any:
        bench.silent = True

    return router


def list_routes(bench: FakeBench) -> APIRouter:
    """Create the list of the benches, which has one, and that of their events."""
    router = APIRouter()

    @router.get("/events")
    async def events(limit: int = 200) -> Any:
        return {"items": bench.events[::-1][:limit], "next": None}

    @router.get("/benches")
    async def benches() -> Any:
        state = {"state": bench.state, "description": bench.state}
        return {"items": [{"name": "bench", "run": None, "drive_kind": "coil_v", **state}]}

    return router


def method_routes(bench: FakeBench) -> APIRouter:
    """Create the routes of methods; documents and previews are those of the service."""
    router = APIRouter(prefix="/methods")

    def find(name: str) -> Method:
        return bench.methods.get(name) or load_method(name)

    @router.get("")
    async def methods() -> Any:
        return {"items": [one | bench.approvals.get((one["name"], 1), {}) for one in METHODS], "next": None}

    @router.get("/{name}")
    @router.get("/{name}/{version:int}")
    async def method(name: str) -> Any:
        return find(name).model_dump(mode="json", by_alias=True, exclude_defaults=True)

    @router.get("/{name}/preview")
    async def preview(name: str) -> Any:
        return make_preview(compile_method(find(name)))

    @router.post("/dry-run")
    async def dry_run(wanted: dict[str, Any]) -> Any:
        try:
            document = wanted["method"]
            found = load_method(document) if isinstance(document, str) else parse_method(document, "the request")
            programme = compile_method(found)
        except MethodError as error:
            return problem(422, "The method was refused", str(error))
        envelope = compute_envelope(programme).model_dump(mode="json", by_alias=True)
        words = {"messages": ["k0 to 3 % (standard deviation)"]} if wanted.get("identifiability", True) else None
        trip = {"unit": "N", "indicate": None, "hold": None, "controlled_stop": None, "trip": 5000.0}
        facts = {"limits": {"force": trip}, "obstacles": [], "unknown": "", "log_bytes": 8_900_000}
        return {
            "envelope": envelope | {"design": words}, "mean_heat_w": envelope["heat_j"] / programme.duration,
            "bench": facts | {"free_bytes": 42_000_000_000}, "identifiability_error": "",
            "preview": make_preview(programme),
        }  # fmt: skip

    @router.post("", status_code=201)
    async def store(wanted: dict[str, Any]) -> Any:
        found = parse_method(wanted, "the request")
        bench.methods[found.name] = found
        length = compile_method(found).duration
        known = {"name": found.name, "title": found.title, "duration_s": length}
        return METHODS[-1] | known | {"version": 2, "source": "stored"}

    return router


def approval_routes(bench: FakeBench) -> APIRouter:
    """Create the routes of versions and their approvals; each method has its included version and a stored one."""
    router = APIRouter(prefix="/methods/{name}")

    def show(name: str, version: int) -> dict[str, Any]:
        stored = {"source": "stored", "created": "2025-03-04T10:00:00Z"} if version > 1 else {}
        return METHODS[-1] | stored | {"name": name, "version": version} | bench.approvals.get((name, version), {})

    @router.get("/versions")
    async def versions(name: str) -> Any:
        return {"items": [show(name, 2), show(name, 1)]}

    @router.post("/{version:int}/approval")
    async def approve(name: str, version: int, request: Request) -> Any:
        own = bench.people.identify(request)
        assert own is not None
        bench.approvals[name, version] = {"approved": MADE.isoformat(), "approved_by": own["person"]["full_name"]}
        return show(name, version)

    @router.delete("/{version:int}/approval")
    async def withdraw(name: str, version: int) -> Any:
        bench.approvals.pop((name, version), None)
        return show(name, version)

    return router


def run_routes(bench: FakeBench) -> APIRouter:
    """Create the routes of runs and jobs."""
    router = APIRouter()

    @router.get("/runs")
    async def runs(request: Request) -> Any:
        query = request.query_params
        bench.searches.append(dict(query))
        wanted = {name: query[name] for name in ("outcome", "specimen") if name in query}
        found = [one for one in bench.runs.values() if wanted.items() <= one.items()]
        found = [one for one in found if (one["trashed"] is not None) == (query.get("trash") == "true")]
        found = [one for one in found if query.get("tag", "") in ("", *one["tags"])]
        return {"items": sorted(found, key=lambda one: one["started"], reverse=True), "next": None}

    @router.get("/runs/{run_id}")
    async def one_run(run_id: str, response: Response) -> Any:
        response.headers["ETag"] = bench.records.make_tag(run_id)
        return bench.runs[run_id]

    @router.post("/runs", status_code=201)
    async def start(wanted: dict[str, Any]) -> Any:
        if bench.refusals:
            bench.refusals -= 1
            return problem(409, "Not possible", REFUSAL)
        return bench.begin(wanted)

    @router.post("/runs/{run_id}/stop")
    async def stop(run_id: str) -> Any:
        bench.state, bench.trip, bench.run = "tripped", TRIP, None
        bench.runs[run_id] |= {"state": "ended", "outcome": "incomplete", "reason": TRIP}
        return bench.runs[run_id]

    return router


def run_control_routes(bench: FakeBench) -> APIRouter:
    """Create the routes that pause, resume and check a run, and repeat or cancel a job.

    ``checkpoint`` exists for tests and ends the run as a pause does.
    """
    router = APIRouter()

    @router.post("/runs/{run_id}/pause")
    async def pause(run_id: str) -> Any:
        assert bench.run is not None
        bench.run["pause"] = PAUSE
        return bench.status()

    @router.post("/checkpoint")
    async def reach_checkpoint() -> Any:
        ended = {"outcome": "incomplete", "ending": "stopped", "reason": f"paused at checkpoint {CHECKPOINT}"}
        bench.state, bench.run = "idle", (bench.run or {}) | ended | {"pause": "", "paused_after": CHECKPOINT}

    @router.post("/runs/{run_id}/resume", status_code=201)
    async def resume(run_id: str) -> Any:
        return bench.begin({"method": "quick", "specimen": "MR-0042", "operator": "", "continues": run_id})

    @router.post("/runs/{run_id}/integrity")
    async def check(run_id: str) -> Any:
        bench.runs[run_id]["integrity"] = "changed"
        return {"integrity": "changed", "recorded_sha256": HASH, "found_sha256": "0" * 64, "checked": None}

    @router.post("/jobs/{job_id}/retry")
    async def retry(job_id: str) -> Any:
        job = bench.runs["run-3"]["jobs"][0]
        job |= {"state": "queued", "error": ""}
        return job

    @router.post("/jobs/{job_id}/cancel")
    async def cancel(job_id: str) -> Any:
        job = next(job for one in bench.runs.values() for job in one["jobs"] if job["id"] == job_id)
        job |= {"state": "cancelled", "position": None}
        return job

    return router


def result_routes(bench: FakeBench) -> APIRouter:
    """Create the routes of jobs and results; every run has the same fit and report."""
    router = APIRouter()

    @router.get("/jobs")
    async def jobs(request: Request) -> Any:
        states = request.query_params.getlist("state")
        found = [job for one in bench.runs.values() for job in one["jobs"] if job["state"] in states]
        return {"items": found, "next": None}

    @router.get("/runs/{run_id}/fit")
    async def fit(run_id: str) -> Any:
        return FileResponse(FIT, filename=f"{run_id}.fit.json")

    @router.get("/runs/{run_id}/report")
    async def report(run_id: str) -> Any:
        return HTMLResponse(REPORT)

    @router.post("/runs/{run_id}/identify")
    async def identify(run_id: str) -> Any:
        return next(job for job in bench.runs[run_id]["jobs"] if job["kind"] == "identify")

    return router


def upload_routes(bench: FakeBench) -> APIRouter:
    """Create the route of uploads; a file with the cell `much` is refused."""
    router = APIRouter()

    @router.post("/logs", status_code=201)
    async def take(file: list[UploadFile], specimen: Annotated[str, Form()] = "") -> Any:
        if b"much" in await file[0].read():
            return problem(422, "The recording was refused", BAD_CELL)
        method = ", ".join(Path(one.filename or "").stem for one in file)
        bench.runs["run-5"] = run(5, "clean", id="run-5", source="import", specimen=specimen, method=method)
        return bench.runs["run-5"]

    return router


def live_routes(bench: FakeBench) -> APIRouter:
    """Create the route of the websocket."""
    router = APIRouter()

    @router.websocket("/live")
    async def live(websocket: WebSocket) -> None:
        await websocket.accept()
        with contextlib.suppress(WebSocketDisconnect, RuntimeError):
            first = await websocket.receive_json()
            csrf = bench.people.sessions.get(websocket.cookies.get(COOKIE, ""), {}).get("csrf")
            if first.get("token") == TOKEN or (csrf and first.get("csrf") == csrf):
                await publish(websocket, bench)
            else:
                await websocket.close(4401)

    return router


async def publish(socket: WebSocket, bench: FakeBench) -> None:
    """Send samples at the rate of the bench, late batches together."""
    await socket.send_json({"topic": "event", "data": bench.record_event("state", "the agent is ready")})
    await socket.send_json({"topic": "clock", "data": {"utc_s": time.time()}})
    await socket.send_json({"topic": "channels", "data": {"channels": describe_channels(CHANNELS), "age_s": 0.0}})
    if bench.last_status is not None:
        await socket.send_json({"topic": "status", "data": bench.last_status})
    sent = round((time.monotonic() - bench.began) * RATE)
    turn, published = 0, len(bench.outbox)
    while not bench.over:
        turn += 1
        for message in bench.outbox[published:]:
            published += 1
            await socket.send_json(message)
        if turn % 10 == 0:
            await socket.send_json({"topic": "clock", "data": {"utc_s": time.time()}})
        if not bench.silent:
            while sent + BATCH < (time.monotonic() - bench.began) * RATE:
                await socket.send_bytes(bench.samples(sent).encode())
                sent += BATCH
            if turn % 3 == 0:
                bench.last_status = bench.status()
                await socket.send_json({"topic": "status", "data": bench.last_status})
        await asyncio.sleep(BATCH / RATE)


@contextlib.contextmanager
def served(bench: FakeBench) -> Any:
    """Run the service on a free port of the loopback interface; yield its address."""
    listener = socket.create_server(("127.0.0.1", 0))
    server = uvicorn.Server(uvicorn.Config(application(bench), log_level="warning", timeout_graceful_shutdown=1))
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
    thread.start()
    try:
        yield f"http://127.0.0.1:{listener.getsockname()[1]}"
    finally:
        bench.over = server.should_exit = True
        thread.join()
        listener.close()


if __name__ == "__main__":
    shown = FakeBench()
    add_history(shown)
    with served(shown) as address:
        sys.stdout.write(f"{address}/#token={TOKEN}\n")
        sys.stdout.flush()
        threading.Event().wait()
