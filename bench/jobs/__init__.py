"""Identification jobs: created by the service, kept in the catalogue, executed by workers."""

from bench.jobs.engine import DaskEngine, JobEngine, start_local_scheduler
from bench.jobs.job_spec import FIT_FILE, REPORT_FILE, IdentifySettings
from bench.jobs.manager import JobManager
from bench.jobs.worker import find_scheduler, run_worker

__all__ = [
    "FIT_FILE",
    "REPORT_FILE",
    "DaskEngine",
    "IdentifySettings",
    "JobEngine",
    "JobManager",
    "find_scheduler",
    "run_worker",
    "start_local_scheduler",
]
