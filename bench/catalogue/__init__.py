"""The catalogue: runs, their logs, and the jobs on them, in a database."""

from bench.catalogue.backup import Copied, back_up, restore_backup
from bench.catalogue.campaign_table import CampaignChange, CampaignTable, ClaimedNotification
from bench.catalogue.catalogue import Catalogue, open_catalogue
from bench.catalogue.database import CATALOGUE_FILE, find_catalogue, make_sqlite_url, open_database
from bench.catalogue.integrity import check_all, check_integrity
from bench.catalogue.job_queue import REPEATABLE_STATES, JobFilter, JobQueue
from bench.catalogue.log_summary import LogSummary, compute_sha256, is_complete, read_log_summary
from bench.catalogue.models import (
    UNFINISHED_STATES,
    BatchRow,
    CampaignEventRow,
    CampaignNotificationRow,
    CampaignRow,
    EventRow,
    JobRow,
    JobState,
    LogIntegrity,
    NoteKind,
    NoteRow,
    RunOutcome,
    RunRow,
    RunState,
)
from bench.catalogue.planning import (
    SHIPPED_VERSION,
    CertificateStore,
    ClaimedKey,
    IdempotencyKeys,
    MethodRow,
    MethodStore,
    Specimen,
    SpecimenStore,
    StoredCertificate,
    find_stored_state,
)
from bench.catalogue.run_filter import RunFilter
from bench.catalogue.run_plan import RunPlan, read_plan
from bench.catalogue.scan import catalogue_log, scan_logs
from bench.catalogue.trash import move_to_trash, restore_from_trash

__all__ = [
    "CATALOGUE_FILE",
    "REPEATABLE_STATES",
    "SHIPPED_VERSION",
    "UNFINISHED_STATES",
    "BatchRow",
    "CampaignChange",
    "CampaignEventRow",
    "CampaignNotificationRow",
    "CampaignRow",
    "CampaignTable",
    "Catalogue",
    "CertificateStore",
    "ClaimedKey",
    "ClaimedNotification",
    "Copied",
    "EventRow",
    "IdempotencyKeys",
    "JobFilter",
    "JobQueue",
    "JobRow",
    "JobState",
    "LogIntegrity",
    "LogSummary",
    "MethodRow",
    "MethodStore",
    "NoteKind",
    "NoteRow",
    "RunFilter",
    "RunOutcome",
    "RunPlan",
    "RunRow",
    "RunState",
    "Specimen",
    "SpecimenStore",
    "StoredCertificate",
    "back_up",
    "catalogue_log",
    "check_all",
    "check_integrity",
    "compute_sha256",
    "find_catalogue",
    "find_stored_state",
    "is_complete",
    "make_sqlite_url",
    "move_to_trash",
    "open_catalogue",
    "open_database",
    "read_log_summary",
    "read_plan",
    "restore_backup",
    "restore_from_trash",
    "scan_logs",
]
