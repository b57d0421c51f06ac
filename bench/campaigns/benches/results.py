"""Results of runs from the jobs in the catalogue."""

import json
from pathlib import Path
from typing import Any

from bench.campaigns.engine import ParameterResult, RunResult
from bench.catalogue import Catalogue, JobFilter, JobRow
from bench.jobs import DIAGNOSIS_FILE, FIT_FILE


def read_result(catalogue: Catalogue, run_id: str) -> RunResult | None:
    """Return the results of a run as far as its jobs are done; None while the first is unfinished."""
    fit = _read_document(catalogue, _find_done(catalogue, run_id, "identify"), FIT_FILE)
    diagnosis = _read_document(catalogue, _find_done(catalogue, run_id, "diagnose"), DIAGNOSIS_FILE)
    failure = _find_failure(catalogue, run_id, "diagnose" if fit else "identify")
    if fit is None and not failure:
        return None
    result = RunResult(failure="" if diagnosis else failure)
    if fit is not None:
        result = result.model_copy(update=_read_fit(fit))
    return result.model_copy(update=_read_diagnosis(diagnosis)) if diagnosis is not None else result


def _find_done(catalogue: Catalogue, run_id: str, kind: str) -> JobRow | None:
    return catalogue.job_queue.find_newest_done(run_id, kind)


def _find_failure(catalogue: Catalogue, run_id: str, kind: str) -> str:
    """Return the reason why a run has no result of a kind; empty if it has one or may still get one."""
    newest = next(iter(catalogue.job_queue.list_jobs(JobFilter(kind=kind, run_id=run_id), 1)), None)
    if newest is None or newest.state not in ("failed", "cancelled"):
        return ""
    return f"{kind} {newest.state}{f': {newest.error}' if newest.error else ''}"


def _read_document(catalogue: Catalogue, job: JobRow | None, name: str) -> Any | None:
    if job is None or job.result is None:
        return None
    try:
        return json.loads((Path(catalogue.resolve_path(job.result)) / name).read_bytes())
    except (OSError, ValueError):
        return None


def _read_fit(fit: Any) -> dict[str, Any]:
    parameters = {name: _read_parameter(one) for name, one in fit.get("parameters", {}).items()}
    return {
        "parameters": {name: one for name, one in parameters.items() if one is not None},
        "rmse_n": (fit.get("rmse_n") or {}).get("train"),
        "noise_floor_n": fit.get("noise_floor_n"),
    }


def _read_parameter(entry: Any) -> ParameterResult | None:
    interval = entry.get("ci95")
    if entry.get("value") is None or not entry.get("identifiable", True):
        return None
    low, high = interval if interval else (None, None)
    return ParameterResult(value=entry["value"], low=low, high=high, unit=entry.get("unit", ""))


def _read_diagnosis(diagnosis: Any) -> dict[str, Any]:
    stroke = diagnosis.get("next_stroke")
    return {
        "is_diagnosed": True,
        "verdict": diagnosis.get("verdict", ""),
        "effects": tuple(effect["name"] for effect in diagnosis.get("effects", ())),
        "next_stroke": stroke.get("segment", stroke) if stroke else None,
    }
