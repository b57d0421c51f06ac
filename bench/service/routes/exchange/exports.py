"""Route that returns the samples of a run for other tools."""

import asyncio
from pathlib import Path
from typing import Annotated, Any

from fastapi import APIRouter, Query
from fastapi.responses import FileResponse

from bench.errors import LogError
from bench.log import FORMATS, Format
from bench.service.context import Context
from bench.service.routes.exchange.offers import MEDIA_TYPES
from bench.service.routes.results import check_complete
from bench.service.transfer import run_command, send_temporary_file

router = APIRouter(prefix="/runs", tags=["runs"])
_FILE: dict[int | str, dict[str, Any]] = {
    200: {"description": "the samples", "content": {MEDIA_TYPES[one]: {} for one in FORMATS}}
}


@router.get("/{run_id}/export", response_class=FileResponse, responses=_FILE)
async def export_samples(
    run_id: str,
    context: Context,
    file_format: Annotated[Format, Query(alias="format", description="of the file; each column names its unit")],
) -> FileResponse:
    """Return the samples of a run with a complete log; the file is made at the request, in some seconds."""
    row = await asyncio.to_thread(context.get_run, run_id)
    check_complete(row, "exported")

    def write(out: str) -> None:
        log = context.locate_log(row)
        run_command(["export", str(log), "--format", file_format, "--out", out], LogError)

    name = f"{Path(row.log).stem}.{file_format}"
    return await asyncio.to_thread(send_temporary_file, context.data, name, MEDIA_TYPES[file_format], write)
