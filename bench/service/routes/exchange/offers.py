"""Formats in which a run is offered; a file is made at its request."""

from collections.abc import Iterator
from typing import NamedTuple
from urllib.parse import quote

from bench.log import FORMATS
from bench.report.formats import REPORT_FORMATS

MEDIA_TYPES = {
    "csv": "text/csv",
    "parquet": "application/vnd.apache.parquet",
    "mat": "application/x-matlab-data",
    "html": "text/html",
    "pdf": "application/pdf",
    "xlsx": "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet",
}
"""Media type of each format."""


class Offer(NamedTuple):
    """File that can be requested of a run with a complete log."""

    name: str
    kind: str
    """`export` or `report`."""
    path: str
    """Path below the interface."""
    media_type: str


def list_offers(run_id: str) -> Iterator[Offer]:
    """Yield exports and reports of a run in all formats."""
    address = f"runs/{quote(run_id, safe='')}"
    for kind, stem, formats in (("export", "samples", FORMATS), ("report", "report", REPORT_FORMATS)):
        for one in formats:
            yield Offer(f"{stem}.{one}", kind, f"{address}/{kind}?format={one}", MEDIA_TYPES[one])
