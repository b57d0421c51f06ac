"""Route that returns the log of a run."""

from fastapi import APIRouter
from fastapi.responses import FileResponse

from bench.service.context import Context
from bench.service.files import SnapshotResponse, describe_file
from bench.service.problems import make_not_found

router = APIRouter(prefix="/runs", tags=["runs"])


@router.get("/{run_id}/log", response_class=FileResponse, responses=describe_file("application/octet-stream"))
def get_log(run_id: str, context: Context) -> SnapshotResponse:
    """Return the log as MCAP; during the run, the part written until the request. Ranges are supported."""
    path = context.locate_log(context.get_run(run_id))
    try:
        return SnapshotResponse(path, "application/octet-stream", path.name)
    except FileNotFoundError:
        raise make_not_found("log of run", f"{run_id} on this machine: {path}") from None
