"""Job specification: what a worker receives, the content key, and the folder of the results."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from bench.jobs.settings import JobSettings, get_kind

FIT_FILE, REPORT_FILE = "fit.json", "report.html"
"""Files in the result folder of an identification."""
TREND_FILE = "trend.json"
"""File in the result folder of a trend."""
SERIES_FILE = "series.npz"
"""Recorded and simulated force in the result folder of an identification or a prediction."""
PREDICTION_FILE = "prediction.json"
"""Document in the result folder of a prediction."""
DIAGNOSIS_FILE, TWIN_FILE = "diagnosis.json", "twin.json"
"""Further files in the result folder of a diagnosis, whose report contains the fit as well."""

ResultSummary = dict[str, Any]
"""Part of a result that the catalogue keeps: errors of a fit; verdict, effects and shrinkage of a diagnosis."""

_FOLDER_WORDS = {"identify": "fit", "diagnose": "diagnosis", "predict": "prediction", "trend": "trend"}


@dataclass(frozen=True)
class JobSpec:
    """One job as it is sent to a worker."""

    job_id: str
    key: str
    log: str
    """Path of the log; a worker on another machine needs the data folder at the same path."""
    result: str
    """Result folder; it appears complete when the job is done."""
    settings: JobSettings
    submission: int = 1
    """Number of times that the job was queued; a request to cancel is meant for one of them."""
    fit: str = ""
    """Fit that the report of a diagnosis shows as well; empty without one."""
    logs: tuple[str, ...] = ()
    """Logs of a trend, the oldest first."""
    model: str = ""
    """Fit or twin that a prediction simulates, or whose own gap a diagnosis reports; empty without one."""
    log_sha256: str = ""
    """Hash of the log, under which its samples are stored; empty if it is not known."""


def compute_content_key(log_sha256: str, settings: JobSettings, inputs: Sequence[str] = ()) -> str:
    """Return the key of a job: equal for equal log, settings, inputs and version of mrbench.

    Args:
        log_sha256: hash of the log.
        settings: of the job.
        inputs: keys of the jobs whose results it reads.
    """
    # The id of a model differs between catalogues; its key, among the inputs, does not.
    text = settings.model_dump_json(exclude={"model"})
    content = f"{get_kind(settings)} {log_sha256} {text} {version('mrbench')}"
    return hashlib.sha256(" ".join([content, *inputs]).encode()).hexdigest()


def get_result_folder(log: Path, kind: str, key: str) -> Path:
    """Return the folder of the results: next to the log, one for each key."""
    return log.with_name(f"{log.stem}.{_FOLDER_WORDS[kind]}-{key[:12]}")
