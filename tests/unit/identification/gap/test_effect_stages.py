"""Every effect at every stage of its use: a new effect is tested here as soon as the effect table lists it.

The recordings are two strokes of four seconds, simulated without noise, with the effect in its usual form at its
medium size (`tests.support.effects`).
"""

import os
import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from identification.damper.effects import COMMON_EFFECTS, EFFECTS
from identification.fitting import EffectModel, Piece, Problem, SearchSpace
from identification.gap.fits import FitOptions, JointFit, fit_jointly
from identification.gap.outcome.explanation import explain_diagnosis
from identification.gap.outcome.verdict import build_named_effects
from identification.gap.selection import Posterior
from identification.gap.selection.screening import list_effect_models, screen
from identification.simulate import Excitation, SimulationModel, simulate
from tests.support.effects import LABORATORY, MEDIUM, active, sine
from tests.support.fit_problems import SCALES
from tests.support.gaps import GAP
from tests.support.sensitivities import compute_worst_error

RATE, SECONDS = 500.0, 4.0
STROKES = ((0.0, 0.014, 1.0), (20.0, 0.006, 2.5))
"""Start [s], amplitude [m] and frequency [Hz] of each stroke."""
NOISE = 0.3
"""Noise floor that the fits assume [N]; the recordings have none."""
MODEL = SimulationModel(LABORATORY, y0=1e-4, force_delay=3.3e-4, drive_delay=1e-4)
TOLERANCE = 5e-3
"""Largest relative error of a fitted parameter [1]; the fits reach 7e-4."""
BASELINE_FIT = FitOptions(decimation=1, starts=1, descents=1, refit_full=False)
FULL_FIT = FitOptions(decimation=1, starts=12, descents=4)
each_effect = pytest.mark.parametrize("name", EFFECTS)


def record(name: str) -> Problem:
    """Return the problem of the law alone on recordings with one effect."""
    t = np.arange(round(SECONDS * RATE)) / RATE
    drive = np.array([0.0, 0.3, 0.1, 0.5, 0.2])[(t / 0.63).astype(int) % 5]
    model, pieces = SimulationModel(LABORATORY, effects=(active(name),)), []
    for start, amplitude, frequency in STROKES:
        w = 2 * np.pi * frequency
        x, v = amplitude * np.sin(w * t), amplitude * w * np.cos(w * t)
        power = (150.0 + 500.0 * drive) * np.abs(v)
        excitation = Excitation(RATE, x, v, -(w**2) * x, drive, start=start, power=power)
        piece = Piece(f"{frequency:g} Hz", excitation, np.zeros(len(t)), np.ones(len(t)))
        pieces.append(replace(piece, force=piece.simulate(model)[0]))
    return Problem(tuple(pieces), SearchSpace(0.0, 0.5, SCALES), NOISE, 2e-5)


@cache
def fit_baseline(name: str) -> tuple[Problem, JointFit]:
    """Return the recordings with one effect and the fit of the law alone."""
    problem = record(name)
    return problem, fit_jointly(problem.decimate(4), (), options=BASELINE_FIT)


@cache
def fit_effect(name: str) -> JointFit:
    """Return the joint fit of the law and the effect of a recording."""
    problem, baseline = fit_baseline(name)
    return fit_jointly(problem, (EffectModel.from_name(name),), baseline, FULL_FIT)


@cache
def read_names() -> dict[str, set[str]]:
    """Return the names of effects by stage: of the contracts if they are available, otherwise of the reference."""
    if shared := os.environ.get("MRBENCH_SHARED"):
        text = (Path(shared) / "contracts.md").read_text(encoding="utf-8")
        rows = re.findall(r"^\| (coil|damper|mounting|\w+ channel) \| (.*) \|$", text, re.MULTILINE)
        return {stage.replace(" ", "_"): set(re.findall(r"`([a-z_]+)`", names)) for stage, names in rows}
    text = (Path(__file__).parents[4] / "docs/reference/effects.md").read_text(encoding="utf-8")
    sections = re.findall(r"^## ([a-z_]+)\n\nStage `([a-z_]+)`", text, re.MULTILINE)
    return {stage: {name for name, its in sections if its == stage} for _, stage in sections}


@each_effect
def test_simulate_the_response_changes_and_is_finite(name):
    plain = simulate(MODEL, sine()).force
    response = simulate(replace(MODEL, effects=(active(name),)), sine(), sensitivities=True)
    assert np.isfinite(response.force).all()
    assert np.isfinite(response.sensitivities).all()
    assert np.sqrt(np.mean((response.force - plain) ** 2)) > NOISE


@each_effect
def test_sensitivities_equal_finite_differences(name):
    assert compute_worst_error(replace(MODEL, effects=(active(name),)), sine()) < 5e-6


@each_effect
def test_screening_ranks_the_effect_first_with_a_gain(name):
    problem, baseline = fit_baseline(name)
    gains = screen(problem, baseline, list_effect_models(tuple(EFFECTS)))
    assert gains[0].effect_model.name == name
    assert gains[0].predicted_gain > 0.0


@each_effect
def test_the_fit_recovers_the_parameters(name):
    fit, baseline = fit_effect(name), fit_baseline(name)[1]
    assert fit.converged
    assert fit.rmse < 0.1 * NOISE < baseline.rmse
    assert tuple(fit.values[name].values()) == pytest.approx(active(name).values, rel=TOLERANCE)


@each_effect
def test_the_name_is_that_of_the_contracts(name):
    assert name in read_names()[EFFECTS[name].stage]


def test_the_contracts_name_every_common_effect():
    assert set(COMMON_EFFECTS) <= set.union(*read_names().values())


SMALL_UNITS = {"µm": (1e-6, "m"), "mm": (1e-3, "m"), "ms": (1e-3, "s")}


@each_effect
def test_the_report_names_the_effect_with_values_and_units(name):
    candidate, posterior = SimpleNamespace(fit=fit_effect(name)), Posterior({frozenset({name}): 0.9}, 0.05)
    (effect,) = build_named_effects(candidate, posterior, {name: (1.0, (0.9, 1.1))}, "V")
    text = explain_diagnosis("explained", GAP, [effect], [], "")
    assert name in text
    assert EFFECTS[name].meaning in text
    for quantity, true in zip(EFFECTS[name].forms[0].parameters, MEDIUM[name][effect.form], strict=True):
        value = effect.parameters[quantity.symbol]
        assert value.value == pytest.approx(true, rel=TOLERANCE)
        assert value.unit == quantity.format_unit("V")
        assert value.unit
        assert "drive" not in value.unit
        shown = re.search(rf"\b{quantity.symbol.replace('_', ' ')} ([-+.e\d]+) ?([^,)]*)[,)]", text)
        factor, unit = SMALL_UNITS.get(shown[2], (1.0, shown[2] or "1"))
        assert float(shown[1]) * factor == pytest.approx(value.value, rel=5e-3)
        assert unit == value.unit
