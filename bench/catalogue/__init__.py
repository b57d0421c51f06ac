"""The catalogue: runs, their logs, and their identification jobs, in a database."""

from bench.catalogue.catalogue import Catalogue
from bench.catalogue.database import make_sqlite_url, open_database
from bench.catalogue.log_summary import is_complete
from bench.catalogue.models import UNFINISHED_STATES, JobRow, JobState, RunOutcome, RunRow, RunState
from bench.catalogue.scan import catalogue_log, scan_logs

__all__ = [
    "UNFINISHED_STATES",
    "Catalogue",
    "JobRow",
    "JobState",
    "RunOutcome",
    "RunRow",
    "RunState",
    "catalogue_log",
    "is_complete",
    "make_sqlite_url",
    "open_database",
    "scan_logs",
]
