"""Routes of predictions, and of recorded over simulated force of fits and predictions."""

from http import HTTPStatus
from typing import Annotated, Any

import orjson
from fastapi import APIRouter, Query, Response
from fastapi.responses import FileResponse
from pydantic import Field

from bench.catalogue import JobRow
from bench.comparison import ForceSeries, StrokeError, find_stroke_errors, read_force_series
from bench.errors import LogError
from bench.jobs import PREDICTION_FILE, SERIES_FILE, Job, JobKind, PredictSettings
from bench.samples import select_extremes
from bench.service.context import Context, ServiceContext
from bench.service.files import SnapshotResponse
from bench.service.problems import ProblemError
from bench.service.requests import IDEMPOTENT, IdempotentRoute
from bench.service.routes.recordings import load_samples
from bench.service.routes.results import (
    JSON_FILE,
    SAME_JOB,
    get_done_job,
    make_file_response,
    request_job,
)
from bench.service.views import View

router = APIRouter(tags=["results"], route_class=IdempotentRoute)
Start = Annotated[float | None, Query(alias="from", allow_inf_nan=False, description="[s] of the run")]
Stop = Annotated[float | None, Query(alias="to", allow_inf_nan=False, description="[s] of the run")]
Points = Annotated[
    int, Query(ge=0, le=1_000_000, description="number of intervals whose extremes are kept; 0: all samples")
]
_DEFAULT_POINTS = 2000


class SimulatedSeries(View):
    """Recorded and simulated force of a run, and the force error of each segment."""

    run: str = Field(description="id of the run")
    drive_unit: str = Field(description="V or A")
    samples: int = Field(description="number of samples in the range")
    decimated: bool = Field(description="true if not all of them are returned")
    time: list[float] = Field(description="time since the first sample of the run [s]")
    values: dict[str, list[float]] = Field(
        description="displacement [m], velocity [m/s], drive [V or A], force, simulated and, if known, lower and "
        "upper end of the 95 % band of the recorded force [N]"
    )
    errors: tuple[StrokeError, ...] = Field(description="force error of each segment, over all its samples")


@router.post("/runs/{run_id}/predict", status_code=201, responses=SAME_JOB, dependencies=[IDEMPOTENT])
async def predict_run(run_id: str, context: Context, response: Response, settings: PredictSettings) -> Job:
    """Queue the simulation of a fit or twin, of this or another run, on the strokes of a run.

    201: queued, also if an equal job had failed or was cancelled. 200: an equal job is unfinished or done.
    """
    return await request_job(context, run_id, settings, response)


@router.get("/predictions/{prediction_id}", response_class=FileResponse, responses=JSON_FILE)
def get_prediction(prediction_id: str, context: Context) -> SnapshotResponse:
    """Return a prediction, `mrbench.prediction/1`; its id is that of its job."""
    job = get_done_job(context, prediction_id, "predict", "prediction")
    return make_file_response(context, job, PREDICTION_FILE)


@router.get("/predictions/{prediction_id}/series", response_model=SimulatedSeries)
def get_prediction_series(
    prediction_id: str,
    context: Context,
    start_s: Start = None,
    stop_s: Stop = None,
    points: Points = _DEFAULT_POINTS,
) -> Response:
    """Return recorded and simulated force of a prediction."""
    return _make_response(context, _get_job(context, prediction_id, "predict"), (start_s, stop_s), points)


@router.get("/fits/{fit_id}/series", response_model=SimulatedSeries)
def get_fit_series(
    fit_id: str, context: Context, start_s: Start = None, stop_s: Stop = None, points: Points = _DEFAULT_POINTS
) -> Response:
    """Return recorded and simulated force of a fit on its own run."""
    return _make_response(context, _get_job(context, fit_id, "identify"), (start_s, stop_s), points)


def _get_job(context: ServiceContext, job_id: str, kind: JobKind) -> JobRow:
    return get_done_job(context, job_id, kind, {"identify": "fit", "predict": "prediction"}[kind])


def _make_response(
    context: ServiceContext, job: JobRow, span: tuple[float | None, float | None], points: int
) -> Response:
    series = _read_series(context, job)
    segments = load_samples(context, job.run_id).segments
    content = _select(series, span, points)
    content |= {
        "run": job.run_id,
        "drive_unit": series.drive_unit,
        "errors": [error.model_dump() for error in find_stroke_errors(series, segments)],
    }
    return Response(orjson.dumps(content, option=orjson.OPT_SERIALIZE_NUMPY), media_type="application/json")


def _read_series(context: ServiceContext, job: JobRow) -> ForceSeries:
    try:
        return read_force_series(context.catalogue.resolve_path(job.result or "") / SERIES_FILE)
    except LogError:
        detail = (
            f"job {job.id} has no series, because an older version made it; "
            f"POST /api/v1/runs/{job.run_id}/predict with this model makes one"
        )
        raise ProblemError(HTTPStatus.NOT_FOUND, "not-found", "Not found", detail) from None


def _select(series: ForceSeries, span: tuple[float | None, float | None], points: int) -> dict[str, Any]:
    """Return the samples of a span of time, decimated."""
    first = 0 if span[0] is None else int(series.time.searchsorted(span[0]))
    last = len(series.time) if span[1] is None else int(series.time.searchsorted(span[1], side="right"))
    part, count = slice(first, last), max(0, last - first)
    values = {name: column[part] for name, column in series.columns.items()}
    if series.half_width is not None:
        values["lower"] = values["simulated"] - series.half_width[part]
        values["upper"] = values["simulated"] + series.half_width[part]
    rows = select_extremes([column.astype("f4") for column in values.values()], count, points or max(1, count))
    return {
        "samples": count,
        "decimated": len(rows) < count,
        "time": series.time[part][rows],
        "values": {name: column[rows] for name, column in values.items()},
    }
