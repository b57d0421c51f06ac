"""Jobs on runs, identification and diagnosis: created by the service, executed by workers."""

from bench.jobs.engine import DaskEngine, JobEngine
from bench.jobs.errors import JobError
from bench.jobs.job_spec import (
    DIAGNOSIS_FILE,
    FIT_FILE,
    PREDICTION_FILE,
    REPORT_FILE,
    SERIES_FILE,
    TREND_FILE,
    TWIN_FILE,
    JobSpec,
    compute_content_key,
    get_result_folder,
)
from bench.jobs.job_view import (
    BatchRequest,
    DiagnosisSummary,
    Job,
    JobPage,
    RetryRequest,
    find_newest_done,
    make_diagnosis_summary,
    make_job_view,
)
from bench.jobs.manager import JobManager
from bench.jobs.scheduler import find_scheduler, run_scheduler, start_scheduler
from bench.jobs.settings import (
    AnalysisKind,
    DiagnoseSettings,
    IdentifySettings,
    JobKind,
    JobSettings,
    PredictSettings,
    TrendSettings,
    get_kind,
    parse_settings,
)
from bench.jobs.tls import SchedulerLocation, get_tls_file, locate_scheduler
from bench.jobs.work import JobCallbacks, execute_job
from bench.jobs.worker import run_worker

__all__ = [
    "DIAGNOSIS_FILE",
    "FIT_FILE",
    "PREDICTION_FILE",
    "REPORT_FILE",
    "SERIES_FILE",
    "TREND_FILE",
    "TWIN_FILE",
    "AnalysisKind",
    "BatchRequest",
    "DaskEngine",
    "DiagnoseSettings",
    "DiagnosisSummary",
    "IdentifySettings",
    "Job",
    "JobCallbacks",
    "JobEngine",
    "JobError",
    "JobKind",
    "JobManager",
    "JobPage",
    "JobSettings",
    "JobSpec",
    "PredictSettings",
    "RetryRequest",
    "SchedulerLocation",
    "TrendSettings",
    "compute_content_key",
    "execute_job",
    "find_newest_done",
    "find_scheduler",
    "get_kind",
    "get_result_folder",
    "get_tls_file",
    "locate_scheduler",
    "make_diagnosis_summary",
    "make_job_view",
    "parse_settings",
    "run_scheduler",
    "run_worker",
    "start_scheduler",
]
