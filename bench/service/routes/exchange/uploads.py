"""Route that takes recordings made elsewhere."""

import asyncio
from collections.abc import Sequence
from typing import Annotated, Literal

from fastapi import APIRouter, File, Form, Response, UploadFile

from bench.catalogue import RunRow
from bench.csv_import import COLUMN_NAMES, REVERSIBLE_COLUMNS, UNITS
from bench.service.context import Context, ServiceContext
from bench.service.problems import make_conflict
from bench.service.requests import IDEMPOTENT, IdempotentRoute
from bench.service.transfer import ReceivedFile, import_files, make_log_name
from bench.service.views import Run

router = APIRouter(prefix="/logs", tags=["runs"], route_class=IdempotentRoute)
_DriveKind = Literal["driver_command_v", "coil_v", "coil_a"]
_Column = Annotated[str, Form(pattern=rf"^({'|'.join(COLUMN_NAMES)})=[^\x00]+$", max_length=200)]
_UNIT_PAIRS = "|".join(f"{name}={unit}" for name, units in UNITS.items() for unit in units)
_Unit = Annotated[str, Form(pattern=f"^({_UNIT_PAIRS})$")]
_Reversed = Annotated[str, Form(pattern=f"^({'|'.join(REVERSIBLE_COLUMNS)})$")]


@router.post("", status_code=201, dependencies=[IDEMPOTENT])
async def upload_recording(
    context: Context,
    response: Response,
    file: Annotated[
        list[UploadFile],
        File(description="CSV files (`.csv`, `.csv.gz`), which become one log, or one log (`.mcap`)"),
    ],
    specimen: Annotated[
        str, Form(max_length=200, pattern=r"^[^\x00]*$", description="of CSV files; a log names its own")
    ] = "",
    drive_kind: Annotated[_DriveKind | None, Form(description="of CSV files; by default by unit")] = None,
    column: Annotated[
        list[_Column] | None, Form(description="NAME=HEADER where the header of a CSV file differs")
    ] = None,
    unit: Annotated[
        list[_Unit] | None, Form(description="NAME=UNIT where the unit of a column of CSV files differs")
    ] = None,
    reverse: Annotated[
        list[_Reversed] | None, Form(description="columns of CSV files that are recorded in the opposite sense")
    ] = None,
) -> Run:
    """Take a recording into the data folder; it is catalogued, identified and diagnosed as a recorded run.

    A CSV file is refused with its name, row and column, and nothing is kept then. A log without an end is taken as
    truncated, to be repaired by `salvage`.
    """
    options = [f"--drive-kind={drive_kind}"] if drive_kind else []
    options += [f"--column={pair}" for pair in column or []]
    options += [f"--unit={pair}" for pair in unit or []] + [f"--reverse={name}" for name in reverse or []]
    row = await _take(context, file, options, specimen)
    response.headers["Location"] = f"/api/v1/runs/{row.id}"
    return (await asyncio.to_thread(context.make_run_views, row))[0]


async def _take(
    context: ServiceContext, uploads: Sequence[UploadFile], options: Sequence[str], specimen: str
) -> RunRow:
    """Import uploaded files and catalogue their log.

    Raises:
        RecordingError: a file is refused.
        ProblemError: the catalogue has the run already.
    """
    files = [ReceivedFile(upload.filename or "", upload.file) for upload in uploads]
    async with import_files(context.data, files, options, specimen) as (found, summary):
        is_import = summary.source == "import"  # the id of an import is the name of its log
        known = None if is_import else await asyncio.to_thread(context.catalogue.get_run, summary.id)
        place = context.data / make_log_name(files[0].name)
        row = await context.registry.adopt(found, place) if known is None else None
        if row is None:
            detail = f"run {summary.id} is in the catalogue already; nothing was kept of the upload"
            raise make_conflict("run-exists", "The run exists", detail)
        return row
