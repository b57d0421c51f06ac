"""Routes of the samples and segments of a run."""

import json
from dataclasses import replace
from http import HTTPStatus
from typing import Annotated, Any, Literal

import orjson
from fastapi import APIRouter, Query, Response

from bench.samples import Channel, SampleTable, encode_batches, select_extremes
from bench.service.context import Context, ServiceContext
from bench.service.problems import ProblemError, shorten
from bench.service.routes.recordings.views import SampleSeries, SegmentList

router = APIRouter(prefix="/runs", tags=["recordings"])
DEFAULT_POINTS = 2000
CHANNELS_HEADER = "X-Mrbench-Channels"
_BINARY = "application/octet-stream"
_TIME = Channel(name="time", unit="s")
_ANSWERS: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "samples; as binary batches with `format=float32`, whose channels the header "
        f"`{CHANNELS_HEADER}` lists",
        "content": {_BINARY: {}},
        "model": SampleSeries,
    }
}


@router.get("/{run_id}/samples", response_model=SampleSeries, responses=_ANSWERS)
def get_samples(
    run_id: str,
    context: Context,
    channel: Annotated[list[str] | None, Query(description="only these channels, by name")] = None,
    start_s: Annotated[
        float | None, Query(alias="from", allow_inf_nan=False, description="[s] since the first sample")
    ] = None,
    stop_s: Annotated[
        float | None, Query(alias="to", allow_inf_nan=False, description="[s] since the first sample")
    ] = None,
    points: Annotated[
        int,
        Query(
            ge=0, le=1_000_000, description="number of intervals of which the extremes are kept; 0: all samples"
        ),
    ] = DEFAULT_POINTS,
    sample_format: Annotated[Literal["json", "float32"], Query(alias="format")] = "json",
) -> Response:
    """Return the samples of a run that has ended; decimation keeps the extremes of every channel."""
    table = _select_channels(load_samples(context, run_id), channel)
    part = table.find_rows(start_s, stop_s)
    columns = [column[part] for column in table.columns.values()]
    count = part.stop - part.start
    rows = part.start + select_extremes(columns, count, points if points else count)
    if sample_format == "float32":
        return _make_batches(table, rows)
    return _make_series(run_id, table, rows, count)


@router.get("/{run_id}/segments")
def get_segments(run_id: str, context: Context) -> SegmentList:
    """Return the segments of a run with their motion, drive and time."""
    table = load_samples(context, run_id)
    return SegmentList(drive_unit=table.drive_unit, items=table.segments)


def load_samples(context: ServiceContext, run_id: str) -> SampleTable:
    """Return the samples of a run.

    Raises:
        ProblemError: there is no such run.
        LogError: its log is missing, is still being written, is truncated or damaged.
    """
    row = context.get_run(run_id)
    return context.sample_store.load(context.locate_log(row), row.log_sha256)


def _select_channels(table: SampleTable, names: list[str] | None) -> SampleTable:
    if names is None:
        return table
    unknown = next((name for name in names if name not in table.columns), None)
    if unknown is not None:
        known = ", ".join(table.columns)
        detail = f"query.channel: {shorten(unknown)} is not recorded in this run; its channels are {known}"
        raise ProblemError(HTTPStatus.UNPROCESSABLE_ENTITY, "invalid-request", "Invalid request", detail)
    return replace(
        table,
        columns={name: table.columns[name] for name in names},
        units={name: table.units[name] for name in names},
    )


def _make_batches(table: SampleTable, rows: Any) -> Response:
    columns = [column[rows] for column in table.columns.values()]
    content = b"".join(encode_batches(table.time[rows], columns, table.started_utc_s or 0.0))
    channels = [one.model_dump() for one in (_TIME, *table.channels)]
    return Response(content, media_type=_BINARY, headers={CHANNELS_HEADER: json.dumps(channels)})


def _make_series(run_id: str, table: SampleTable, rows: Any, count: int) -> Response:
    content = {
        "run": run_id,
        "started_utc_s": table.started_utc_s,
        "samples": count,
        "decimated": len(rows) < count,
        "channels": [one.model_dump() for one in table.channels],
        "time": table.time[rows],
        "values": {name: column[rows] for name, column in table.columns.items()},
    }
    return Response(orjson.dumps(content, option=orjson.OPT_SERIALIZE_NUMPY), media_type="application/json")
