"""Comparison of a case's truth with its diagnosis."""

from pathlib import Path
from typing import Any

import orjson

from sim_rig.trial.cases import DiagnosisOutcome, TrialFolder, TrueCase, compute_noise_floor
from sim_rig.trial.execution import WIRES_SUFFIX
from sim_rig.trial.scoring.trial_report import CaseResult, NamedSet

MIN_PROBABILITY = 1e-3
"""[1] smallest probability of the truth in the scores: a set that is not listed does not count as impossible."""


def unseal_case(folder: TrialFolder, case: TrueCase, name: str) -> CaseResult:
    """Return the result of one case of a trial, from its recording ``name``."""
    files = folder.get_case_files(name)
    outcome = folder.read_outcome(name) or DiagnosisOutcome(seconds=0.0, failure="it has not been diagnosed")
    diagnosis = _read_json(files.diagnosis) if outcome.failure is None else None
    return evaluate_case(case, name, outcome, diagnosis, _read_json(files.prediction))


def evaluate_case(
    case: TrueCase,
    name: str,
    outcome: DiagnosisOutcome,
    diagnosis: dict[str, Any] | None,
    prediction: dict[str, Any] | None = None,
) -> CaseResult:
    """Evaluate the diagnosis of one case.

    Args:
        case: the truth.
        name: of the recording.
        outcome: duration and failure of the diagnosis.
        diagnosis: the document `mrbench.diagnosis/1`, if there is one.
        prediction: of the twin on the validation run, `mrbench.prediction/1`, if there is one.
    """
    base: dict[str, Any] = {
        **case.model_dump(include={"kind", "magnitude", "method", "damper", "noise"}),
        "id": name,
        "wired": name.endswith(WIRES_SUFFIX),
        "truth": tuple(sorted(effect.name for effect in case.effects)),
        "ratios": {effect.name: effect.ratio for effect in case.effects},
        "seconds": outcome.seconds,
    }
    if diagnosis is None:
        failure = outcome.failure or "its diagnosis cannot be read"
        return CaseResult(
            **base,
            failure=failure,
            correct=False,
            correct_or_alternative=False,
            truth_probability=MIN_PROBABILITY,
        )
    claims = _extract_claims(diagnosis)
    shrinkage = None if prediction is None else compute_true_shrinkage(prediction, compute_force_noise(case))
    return CaseResult(**base, **claims, failure=None, true_shrinkage=shrinkage, **_evaluate_claims(case, claims))


def _extract_claims(diagnosis: dict[str, Any]) -> dict[str, Any]:
    effects, gap = diagnosis["effects"], diagnosis["gap"]
    named = NamedSet(effects=tuple(sorted(e["name"] for e in effects)), probability=diagnosis["probability"])
    noise, interval = gap["noise_floor_n"], gap.get("shrinkage_ci95")
    return {
        "verdict": diagnosis["verdict"],
        "named_set": named,
        "alternatives": tuple(
            NamedSet(effects=tuple(sorted(other["effects"])), probability=other["probability"])
            for other in diagnosis["alternatives"]
        ),
        "unknown_probability": diagnosis["unknown_probability"],
        "effect_probabilities": {effect["name"]: effect["probability"] for effect in effects},
        "effect_shares": {effect["name"]: effect["share"] for effect in effects},
        "stage": diagnosis["where"]["stage"],
        "error_ratio_before": gap["before_n"] / noise,
        "error_ratio_after": gap["after_n"] / noise,
        "claimed_shrinkage": gap["shrinkage"],
        "claimed_ci95": tuple(interval) if interval else None,
    }


def _evaluate_claims(case: TrueCase, claims: dict[str, Any]) -> dict[str, Any]:
    """Return whether the true set was named or listed, and its probability.

    A set is correct only as a whole. Without effects, the verdict must be `no_gap`. With an effect that the
    library does not have, no library effect may be named, and the verdict must not be `no_gap`.
    """
    truth = tuple(sorted(effect.name for effect in case.effects))
    named, others = claims["named_set"], claims["alternatives"]
    if case.kind == "unknown":
        correct = not named.effects and claims["verdict"] != "no_gap"
        matching, probability = [], claims["unknown_probability"]
    else:
        correct = named.effects == truth and claims["verdict"] != "unexplained"
        matching = [other.probability for other in others if other.effects == truth]
        probability = named.probability if correct else max(matching, default=0.0)
    return {
        "correct": correct,
        "correct_or_alternative": correct or bool(matching),
        "truth_probability": max(probability, MIN_PROBABILITY),
    }


def compute_true_shrinkage(prediction: dict[str, Any], noise: float) -> float | None:
    """Return the shrinkage [1] of a twin on a validation run; None if its baseline is at the noise floor.

    Args:
        prediction: the document `mrbench.prediction/1`.
        noise: true noise of the force [N].
    """
    if prediction.get("before_n") is None:
        return None
    before, after = prediction["before_n"], prediction["rmse_n"]
    if before < 1.02 * noise:
        return None
    return float(1 - (after**2 - noise**2) / (before**2 - noise**2))


def compute_force_noise(case: TrueCase) -> float:
    """Return the noise of the recorded force [N], white and coloured."""
    return compute_noise_floor(case.damper, case.scenario["sensors"]["force"])


def _read_json(path: Path) -> dict[str, Any] | None:
    try:
        document: dict[str, Any] = orjson.loads(path.read_bytes())
    except (OSError, orjson.JSONDecodeError):
        return None
    return document
