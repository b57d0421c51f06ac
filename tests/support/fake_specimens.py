"""Specimens of the fake service: descriptions with ETags, eight runs of one, its trend and its fits.

All documents are made by the models of the service, so that they cannot differ from them.
"""

import math
from datetime import UTC, datetime, timedelta
from typing import Any

from fastapi import APIRouter, HTTPException, Request, Response
from fastapi.responses import JSONResponse

from bench.jobs import DiagnosisSummary, TrendSettings
from bench.service.routes.planning.views import (
    ParameterValue,
    RunParameters,
    SpecimenChange,
    SpecimenLimits,
    SpecimenPage,
    SpecimenParameters,
    SpecimenView,
)
from identification.documents import Provenance, QuantityTrend, Trend, TrendRun, TrendValue

WITH_ONE_RUN = "MR-0050"
"""Specimen with a single run."""
SERIAL = "MR-0100"
FIRST = datetime(2025, 2, 3, 9, 15, tzinfo=UTC)
DAYS = (0.0, 1.0, 4.0, 7.0, 9.0, 14.0, 16.0, 21.0)
"""Starts of the runs after the first one."""
IDS = tuple(f"age-{k + 1}" for k in range(len(DAYS)))
PRELOAD = (100.6, 99.5, 100.2, 99.8, 93.7, 88.4, 81.6, 76.1)
"""Preload of the gas [N]; it falls from the fifth run on."""
YIELD = (44.9, 45.1, 45.0, 44.9, 45.05, 45.0, 44.95, 45.1)
STIFFNESS = (903.0, 899.0, 1010.0, 901.0, 897.0, 900.0, 902.0, 898.0)
"""Stiffness k0 [N/m]; the third run was recorded cold."""
EXPLANATION = (
    "Over 8 runs: gas_spring.preload falls by 6.01 N per run since age-5.mcap (101 to 76.1). "
    "Check: the gas pressure of the accumulator."
)
CHANGED_MEANWHILE = "specimen MR-0100 was changed meanwhile; read it again and repeat the change"


def add_history(bench: Any) -> None:
    """Add the runs of a specimen that ages to a fake bench."""
    found = {"verdict": "explained", "effects": ("gas_spring",), "probability": 0.97, "before_n": 9.1}
    numbers = {"after_n": 2.6, "noise_floor_n": 2.5, "shrinkage": 0.98, "shrinkage_ci95": (0.95, 0.99)}
    diagnosis = DiagnosisSummary(id="diagnosis", explanation="A gas spring.", **found, **numbers)
    for run_id, days in zip(IDS, DAYS, strict=True):
        bench.runs[run_id] = bench.runs["run-1"] | {
            "id": run_id, "specimen": SERIAL, "log": f"{run_id}.mcap", "log_sha256": "5f" * 32,
            "started": (FIRST + timedelta(days=days)).isoformat(), "diagnosis": diagnosis.model_dump(mode="json"),
            "jobs": [bench.runs["run-1"]["jobs"][0] | {"id": f"job-{run_id}", "run": run_id}],
        }  # fmt: skip
    bench.runs["only"] = bench.runs["run-1"] | {
        "id": "only",
        "specimen": WITH_ONE_RUN,
        "diagnosis": None,
        "jobs": [],
    }


def make_trend() -> Trend:
    """Return the trend over the runs: one effect that falls, a steady coordinate, one that is not determined."""
    logs = [f"{run_id}.mcap" for run_id in IDS]
    return Trend(
        specimen=SERIAL,
        runs=[
            TrendRun(log=log, verdict="explained", effects=["gas_spring"], before_n=9.1, noise_floor_n=2.5)
            for log in logs
        ],
        effects=["gas_spring"],
        changes=[
            _make_change("gas_spring.preload", "N", PRELOAD, 1.2, -6.01, logs[4]),
            _make_change("F_a", "N", YIELD, 0.15),
            _make_change("k0", "N/m", STIFFNESS, 6.0),
            _make_change("eta", "1/s", (190.0,) * len(logs), math.inf),
        ],
        explanation=EXPLANATION,
        provenance=Provenance(logs=dict.fromkeys(logs, "5f" * 32), version="0.1.0", seed=1, settings={"runs": 8}),
    )


def _make_change(
    quantity: str, unit: str, values: tuple[float, ...], width: float, slope: float = 0.0, since: str | None = None
) -> QuantityTrend:
    """Return the course of a quantity; ``width`` is the half width of its interval."""
    intervals = [(value - width, value + width) if math.isfinite(width) else None for value in values]
    return QuantityTrend(
        quantity=quantity,
        unit=unit,
        direction="falling" if since else "steady",
        since=since,
        change_per_run=slope,
        deviations=24.0 if since else 0.6,
        values=[
            TrendValue(log=f"{run_id}.mcap", value=value, ci95=interval)
            for run_id, value, interval in zip(IDS, values, intervals, strict=True)
        ],
    )


def make_parameters() -> SpecimenParameters:
    """Return the parameters of the fits; the stiffness is not determined in the second run."""
    items = []
    for k, (run_id, days) in enumerate(zip(IDS, DAYS, strict=True)):
        interval = None if k == 1 else (STIFFNESS[k] - 6.0, STIFFNESS[k] + 6.0)
        k0 = ParameterValue(value=STIFFNESS[k], unit="N/m", ci95=interval, identifiable=interval is not None)
        alpha = ParameterValue(value=1.5e6 + 400 * k, unit="N/m", ci95=(1.49e6, 1.51e6), identifiable=True)
        started = FIRST + timedelta(days=days)
        items.append(
            RunParameters(
                run=run_id, started=started, fit=f"job-{run_id}", parameters={"alpha_a": alpha, "k0": k0}
            )
        )
    return SpecimenParameters(items=tuple(items))


class Descriptions:
    """Descriptions of the specimens, with the number of changes of each."""

    def __init__(self, bench: Any) -> None:
        self.bench = bench
        self.known = {SERIAL: SpecimenChange(description="Endurance damper, serviced in January",
                                             damper_kind="RD-8040-1", drive_kind="coil_v",
                                             limits=SpecimenLimits(stroke_m=0.025, force_n=1500.0))}  # fmt: skip
        self.revisions = {SERIAL: 1}

    def view(self, serial: str) -> SpecimenView:
        """Return a specimen; 404 if neither a run nor a description names it."""
        runs = [one for one in self.bench.runs.values() if one["specimen"] == serial]
        if not runs and serial not in self.known:
            raise HTTPException(404, "no such specimen")
        known = self.known.get(serial, SpecimenChange())
        last = max((datetime.fromisoformat(one["started"]) for one in runs), default=None)
        registered = FIRST if serial in self.known else None
        facts = known.model_dump(exclude={"limits"}) | {"limits": known.limits}
        return SpecimenView(serial=serial, runs=len(runs), last_run=last, registered=registered, **facts)

    def tag(self, serial: str) -> str:
        """Return the ETag of a description."""
        return f'"{self.revisions.get(serial, 0)}"'

    def change(self, serial: str, change: SpecimenChange) -> None:
        """Set what a request names."""
        known = self.known.get(serial, SpecimenChange())
        self.known[serial] = known.model_copy(
            update={name: getattr(change, name) for name in change.model_fields_set}
        )
        self.revisions[serial] = self.revisions.get(serial, 0) + 1


def specimen_routes(bench: Any) -> APIRouter:
    """Create the routes of specimens; ``finish-trend`` exists for tests and ends the job of the trend."""
    router = APIRouter(prefix="/specimens")
    store = Descriptions(bench)

    @router.get("")
    async def specimens(text: str = "") -> SpecimenPage:
        serials = {one["specimen"] for one in bench.runs.values() if one["specimen"]} | set(store.known)
        found = [store.view(serial) for serial in sorted(serials)]
        return SpecimenPage(
            items=tuple(one for one in found if text.lower() in (one.serial + one.description).lower()), next=None
        )

    @router.get("/{serial}")
    async def specimen(serial: str, response: Response) -> SpecimenView:
        response.headers["ETag"] = store.tag(serial)
        return store.view(serial)

    @router.patch("/{serial}")
    async def change(serial: str, wanted: SpecimenChange, request: Request, response: Response) -> Any:
        if request.headers.get("if-match") != store.tag(serial):
            content = {"title": "Changed meanwhile", "status": 412, "detail": CHANGED_MEANWHILE}
            return JSONResponse(content, status_code=412, media_type="application/problem+json")
        store.change(serial, wanted)
        return await specimen(serial, response)

    @router.get("/{serial}/parameters")
    async def parameters(serial: str) -> SpecimenParameters:
        return make_parameters() if serial == SERIAL else SpecimenParameters(items=())

    add_trend_routes(router, bench)
    return router


def add_trend_routes(router: APIRouter, bench: Any) -> None:
    """Add the routes of the trend, which belongs to the newest run."""
    settings = TrendSettings(runs=IDS).model_dump(mode="json")
    job = {"id": "job-trend", "run": IDS[-1], "kind": "trend", "state": "running", "stage": "diagnose",
           "fraction": 0.4, "activity": "run 4 of 8", "settings": settings, "version": "0.1.0"}  # fmt: skip

    @router.get("/{serial}/trend")
    async def trend(serial: str) -> Any:
        return make_trend().model_dump(mode="json", by_alias=True)

    @router.post("/{serial}/trend", status_code=201)
    async def request_trend(serial: str) -> Any:
        run = bench.runs[IDS[-1]]
        run["jobs"].append(
            run["jobs"][0] | {"finished": None, "rmse_n": None, "noise_floor_n": None, "result": ""} | job
        )
        return run["jobs"][-1]

    @router.post("/{serial}/finish-trend")
    async def finish(serial: str) -> Any:
        ended = {"state": "done", "fraction": 1.0, "activity": "", "finished": "2025-02-25T08:00:00Z"}
        bench.runs[IDS[-1]]["jobs"][-1] |= ended
        bench.outbox.append({"topic": "job", "data": bench.runs[IDS[-1]]["jobs"][-1]})
