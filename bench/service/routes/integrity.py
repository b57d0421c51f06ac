"""Route that compares the log of a run with the hash that was stored when it was recorded."""

from fastapi import APIRouter

from bench.catalogue import RunRow, check_integrity
from bench.log_store import hash_object
from bench.service.context import Context
from bench.service.problems import make_conflict
from bench.service.views import Integrity

router = APIRouter(prefix="/runs", tags=["runs"])


@router.get("/{run_id}/integrity")
def get_integrity(run_id: str, context: Context) -> Integrity:
    """Return the result of the latest comparison of the log with its stored hash."""
    return _make_view(context.get_run(run_id))


@router.post("/{run_id}/integrity")
def check_run_integrity(run_id: str, context: Context) -> Integrity:
    """Compare the log with its stored hash now; the stored hash never changes."""
    row = context.get_run(run_id)
    if row.log_sha256 is None:
        raise make_conflict(
            "no-stored-hash", "No stored hash", f"run {run_id} is {row.state}; only a complete log has a hash"
        )
    return _make_view(check_integrity(context.catalogue, row, lambda url: hash_object(url)[0]))


def _make_view(row: RunRow) -> Integrity:
    return Integrity(
        integrity=row.integrity,
        recorded_sha256=row.log_sha256,
        found_sha256=row.log_sha256 if row.integrity == "intact" else row.found_sha256,
        checked=row.checked,
        copy_url=row.copy_url,
        copied=row.copied,
        removed=row.removed,
    )
