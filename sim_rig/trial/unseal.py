"""Truth and diagnosis of a case, side by side."""

from pathlib import Path
from typing import Any

import orjson

from sim_rig.trial.answer import CaseAnswer, NamedSet
from sim_rig.trial.calibrate import floor
from sim_rig.trial.folder import Outcome, TrialFolder
from sim_rig.trial.run import WIRES
from sim_rig.trial.truth import TrueCase

LEAST = 1e-3
"""[1] a probability counts as at least this much: what is not said cannot be held for impossible."""


def unsealed(folder: TrialFolder, case: TrueCase, name: str) -> CaseAnswer:
    """The answer on one case of a trial; ``name`` says which recording of it."""
    files = folder.files(name)
    outcome = folder.outcome(name) or Outcome(seconds=0.0, failure="it has not been diagnosed")
    diagnosis = _read(files.diagnosis) if outcome.failure is None else None
    return judged(case, name, outcome, diagnosis, _read(files.prediction))


def judged(
    case: TrueCase,
    name: str,
    outcome: Outcome,
    diagnosis: dict[str, Any] | None,
    prediction: dict[str, Any] | None = None,
) -> CaseAnswer:
    """One case judged.

    Args:
        case: the truth.
        name: of the recording.
        outcome: how the diagnosis went.
        diagnosis: the document `mrbench.diagnosis/1`, if there is one.
        prediction: the twin on the run that was not seen, `mrbench.prediction/1`, if there is one.
    """
    base: dict[str, Any] = {
        **case.model_dump(include={"kind", "magnitude", "method", "damper", "noise"}),
        "id": name,
        "over_wires": name.endswith(WIRES),
        "truth": tuple(sorted(effect.name for effect in case.effects)),
        "ratios": {effect.name: effect.ratio for effect in case.effects},
        "seconds": outcome.seconds,
    }
    if diagnosis is None:
        failure = outcome.failure or "its diagnosis cannot be read"
        return CaseAnswer(**base, failure=failure, right=False, among=False, probability_of_truth=LEAST)
    said = _said(diagnosis)
    shrunk = None if prediction is None else true_shrinkage(prediction, force_noise(case))
    return CaseAnswer(**base, **said, failure=None, true_shrinkage=shrunk, **_verdict_on(case, said))


def _said(diagnosis: dict[str, Any]) -> dict[str, Any]:
    effects, gap = diagnosis["effects"], diagnosis["gap"]
    named = NamedSet(effects=tuple(sorted(e["name"] for e in effects)), probability=diagnosis["probability"])
    noise, interval = gap["noise_floor_n"], gap.get("shrinkage_ci95")
    return {
        "verdict": diagnosis["verdict"],
        "named": named,
        "alternatives": tuple(
            NamedSet(effects=tuple(sorted(other["effects"])), probability=other["probability"])
            for other in diagnosis["alternatives"]
        ),
        "unknown_probability": diagnosis["unknown_probability"],
        "odds": {effect["name"]: effect["probability"] for effect in effects},
        "stage": diagnosis["where"]["stage"],
        "before_over_floor": gap["before_n"] / noise,
        "after_over_floor": gap["after_n"] / noise,
        "claimed_shrinkage": gap["shrinkage"],
        "claimed_ci95": tuple(interval) if interval else None,
    }


def _verdict_on(case: TrueCase, said: dict[str, Any]) -> dict[str, Any]:
    """Whether it was right, nearly, and with what probability.

    A set is right only as a whole. Where nothing is at work, the verdict has to be `no_gap`; where the effect is
    one that the library does not know, no known one may be named, and the verdict may not be `no_gap` either.
    """
    truth = tuple(sorted(effect.name for effect in case.effects))
    named, others = said["named"], said["alternatives"]
    if case.kind == "unknown":
        right = not named.effects and said["verdict"] != "no_gap"
        return {"right": right, "among": right, "probability_of_truth": max(said["unknown_probability"], LEAST)}
    unexplained = said["verdict"] == "unexplained"
    right = named.effects == truth and not unexplained
    fitting = [other.probability for other in others if other.effects == truth]
    given = named.probability if right else max(fitting, default=0.0)
    return {"right": right, "among": right or bool(fitting), "probability_of_truth": max(given, LEAST)}


def true_shrinkage(prediction: dict[str, Any], noise: float) -> float | None:
    """Shrinkage [1] of a twin on a run that nobody saw; None where its baseline stands at the floor there.

    Args:
        prediction: the document `mrbench.prediction/1`.
        noise: of the force, as the rig really has it [N].
    """
    if prediction.get("before_n") is None:
        return None
    before, after = prediction["before_n"], prediction["rmse_n"]
    if before < 1.02 * noise:
        return None
    return float(1 - (after**2 - noise**2) / (before**2 - noise**2))


def force_noise(case: TrueCase) -> float:
    """Noise of the recorded force [N], white and coloured."""
    return floor(case.damper, case.scenario["sensors"]["force"])


def _read(path: Path) -> dict[str, Any] | None:
    try:
        found: dict[str, Any] = orjson.loads(path.read_bytes())
    except (OSError, orjson.JSONDecodeError):
        return None
    return found
