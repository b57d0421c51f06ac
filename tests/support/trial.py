"""Truths and diagnoses for tests of the blind trial."""

from typing import Any

from sim_rig.trial.cases.folder import DiagnosisOutcome
from sim_rig.trial.cases.truth import TrueCase, TrueEffect

FORMS = {"gas_spring": "gas_with_wall", "end_stop": "relaxing_rubber", "moving_mass": "mass_with_bracket"}


def make_truth(*names: str, kind: str = "", ratio: float = 2.0, **more: Any) -> TrueCase:
    """Return a case with these effects; a name outside `FORMS` is an unknown effect."""
    kinds = {0: "nothing", 1: "single", 2: "pair", 3: "triple"}
    effects = tuple(
        TrueEffect(
            name=n, form=FORMS.get(n, "x"), stage="damper", in_library=n in FORMS, parameters={}, ratio=ratio
        )
        for n in names
    )
    defaults = {"id": "case_000", "method": "rich", "damper": "small", "noise": "white", "magnitude": "large"}
    return TrueCase.model_validate(
        {
            **defaults,
            "variant": 0,
            "seed": 1,
            "scenario": {"sensors": {"force": {"noise": 2.5}}},
            "kind": kind or kinds[len(names)],
            "effects": effects,
            **more,
        }
    )


def make_diagnosis(verdict: str, *names: str, probability: float = 0.8, **more: Any) -> dict[str, Any]:
    """Return a diagnosis that names these effects."""
    return {
        "verdict": verdict,
        "effects": [{"name": name, "probability": 0.9, "share": 0.6} for name in names],
        "alternatives": [],
        "probability": probability,
        "unknown_probability": 0.1,
        "gap": {
            "before_n": 5.0,
            "after_n": 2.6,
            "noise_floor_n": 2.5,
            "shrinkage": 0.97,
            "shrinkage_ci95": [0.9, 0.99],
        },
        "where": {"stage": "damper"},
        **more,
    }


SUCCESSFUL = DiagnosisOutcome(seconds=12.0, failure=None)
