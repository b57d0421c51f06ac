"""Summaries of results, as the catalogue keeps them: enough for a list of runs, without opening a document."""

import json
from pathlib import Path

from bench.errors import BenchError
from bench.jobs.errors import JobError
from bench.jobs.job_spec import ResultSummary
from bench.report import read_diagnosis, read_fit, read_prediction


def read_fit_summary(path: Path) -> ResultSummary:
    """Read the summary of a fit.

    Raises:
        JobError: the file is not a fit.
    """
    try:
        fit = read_fit(path)
        document = json.loads(path.read_text("utf-8"))
    except (BenchError, OSError, ValueError) as error:
        raise JobError(f"{path} cannot be read: {error}") from None
    return {
        "result": document.get("result", ""),
        "rmse_n": fit.rmse_n.train,
        "held_out_rmse_n": fit.rmse_n.held_out,
        "noise_floor_n": fit.noise_floor_n,
        "parameters": {name: estimate.value for name, estimate in fit.parameters.items()},
    }


def read_diagnosis_summary(path: Path) -> ResultSummary:
    """Read the summary of a diagnosis.

    Raises:
        JobError: the file is not a diagnosis.
    """
    try:
        diagnosis = read_diagnosis(path)
    except BenchError as error:
        raise JobError(f"{path} cannot be read: {error}") from None
    gap = diagnosis.gap
    return {
        "verdict": diagnosis.verdict,
        "effects": [effect.name for effect in diagnosis.effects],
        "probability": diagnosis.probability,
        "before_n": gap.before_n,
        "after_n": gap.after_n,
        "noise_floor_n": gap.noise_floor_n,
        "shrinkage": gap.shrinkage,
        "shrinkage_ci95": gap.shrinkage_ci95,
        "explanation": diagnosis.explanation,
    }


def read_trend_summary(path: Path) -> ResultSummary:
    """Read the summary of a trend.

    Raises:
        JobError: the file is not a trend.
    """
    try:
        document = json.loads(path.read_text("utf-8"))
        changed = [one["quantity"] for one in document["changes"] if one["direction"] != "steady"]
        return {"changes": changed, "explanation": document["explanation"]}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise JobError(f"{path} cannot be read: {error}") from None


def read_prediction_summary(path: Path) -> ResultSummary:
    """Read the summary of a prediction.

    Raises:
        JobError: the file is not a prediction.
    """
    try:
        prediction = read_prediction(path)
    except BenchError as error:
        raise JobError(f"{path} cannot be read: {error}") from None
    return {
        "rmse_n": prediction.rmse_n,
        "nrmse": prediction.nrmse,
        "bias_n": prediction.bias_n,
        "noise_floor_n": prediction.noise_floor_n,
        "before_n": prediction.before_n,
    }
