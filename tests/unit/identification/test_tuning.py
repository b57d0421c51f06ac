"""Tuning: a study finds the better settings, prunes, goes on where it stopped, and writes what it found."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from test_identify import FAST, recording

from identification.assemble import assemble
from identification.damper.coordinates import Coordinates
from identification.errors import IdentificationError
from identification.identify import fit_problem
from identification.pinn.result import Errors
from identification.pinn.settings import read_settings
from identification.problem import COORDINATE_COUNT
from identification.refine import refine
from identification.tuning import study
from identification.tuning.commands import tune
from identification.tuning.offset import offset
from identification.tuning.space import settings_of, values_of
from identification.tuning.summary import importances

pytestmark = pytest.mark.filterwarnings("ignore::optuna.exceptions.ExperimentalWarning")


@dataclass
class Found:
    simulation: Errors
    seconds: float = 1.0
    accepted: bool = True


@dataclass
class FoundAt:
    coordinates: Coordinates
    delays: tuple[float, float]


@pytest.fixture
def trained(monkeypatch):
    """Trainings that end at once: the better, the nearer the weight of the law is to 50 and the rank to 40."""
    seen = []

    def train(problem, settings, supervision):
        level, layer = settings.levels[-1], settings.layers[0]
        error = problem.noise * (1 + 0.1 * abs(level.physics / 50 - 1) + 0.01 * abs(layer.rank - 40))
        seen.append(settings)
        supervision.step("local", error)
        return Found(Errors(error, error))

    monkeypatch.setattr(study, "train", train)
    monkeypatch.setattr(study, "load", lambda log: recording(FAST))
    monkeypatch.setattr(study, "offset", lambda problem, found: 0.0)
    return seen


def order(folder, trials, **changes):
    given = {"logs": (Path("a.mcap"),), "preset": "local", "study": folder / "s.db", "budget": 10.0, "price": 0.0}
    return study.Order(**(given | {"trials": trials, "seed": 1} | changes))


def test_a_study_finds_better_settings_than_it_began_with(trained, tmp_path):
    said = []
    found = study.run(order(tmp_path, 25), 1, said.append)
    values = [t.value for t in found.trials]
    assert len(trained) == len(said) == 25
    assert min(values) < 0.93 * max(values)
    assert min(values[15:]) <= min(values[:5])
    best = study.best_settings(found, "local")
    assert best.levels[-1].physics == found.best_params["physics"]
    assert best.layers[1:] == tuple(s for s in read_settings("local").layers[1:] if s.rank > best.layers[0].rank)
    assert set(importances(found)) == set(found.best_params)


def test_a_study_goes_on_where_it_stopped(trained, tmp_path):
    study.run(order(tmp_path, 3), 1, print)
    again = study.run(order(tmp_path, 5), 1, print)
    assert len(trained) == 5
    assert [t.number for t in again.trials] == [0, 1, 2, 3, 4]


@pytest.mark.parametrize("preset", ["local", "global", "paper"])
def test_a_study_begins_with_the_preset_itself(trained, tmp_path, preset):
    own = read_settings(preset)
    assert settings_of(own, values_of(own)) == own
    if preset == "local":
        study.run(order(tmp_path, 1), 1, print)
        assert trained[0] == own


def test_a_study_of_several_dampers_takes_the_mean_over_them(trained, monkeypatch, tmp_path):
    monkeypatch.setattr(study, "offset", lambda problem, found: 3**0.5 * (len(trained) - 1))
    found = study.run(order(tmp_path, 1, logs=(Path("a.mcap"), Path("b.mcap")), price=0.25), 1, print)
    (only,) = found.trials
    assert len(trained) == 2
    assert only.user_attrs["offset"] == pytest.approx(3**0.5 / 2)
    # The second damper's parameters are off by as much as doubles an error of one deviation.
    assert only.value == pytest.approx(only.user_attrs["error"] + 0.5 + 0.25)


def test_the_offset_is_the_distance_from_the_best_simulated_fit_in_deviations():
    given = fit_problem(assemble([recording(FAST)]))
    best = refine(given)
    kept = given.free & (np.arange(len(given.free)) < COORDINATE_COUNT)
    spread = np.linalg.inv(best.evaluation.hessian[np.ix_(given.free, given.free)])
    deviations = np.sqrt(np.diag(spread)[: kept.sum()])
    for far in (0.0, 0.5):
        moved = best.unknowns.copy()
        moved[kept] += far * deviations * (-1.0) ** np.arange(kept.sum())
        delays = tuple(moved[COORDINATE_COUNT:][:2] * given.delay_prior)
        there = FoundAt(given.space.to_coordinates(moved[:COORDINATE_COUNT]), delays)
        assert offset(given, there) == pytest.approx(far, rel=0.15, abs=0.1)


def test_a_study_of_other_logs_is_refused(trained, tmp_path):
    study.run(order(tmp_path, 1), 1, print)
    with pytest.raises(IdentificationError, match="holds a study of"):
        study.run(order(tmp_path, 2, logs=(Path("b.mcap"),)), 1, print)


def test_a_slow_training_is_dearer(trained, tmp_path):
    cheap = study.run(order(tmp_path, 1), 1, print).best_value
    dear = study.run(order(tmp_path, 1, study=tmp_path / "t.db", price=0.5), 1, print).best_value
    assert dear == pytest.approx(cheap + 0.5)


def test_a_hopeless_trial_is_pruned(monkeypatch, tmp_path):
    count = iter(range(100))

    def train(problem, settings, supervision):
        """Every later training is ten times worse than the six before anything is pruned."""
        worse = 1.0 if next(count) < 7 else 10.0
        for _ in range(40):
            supervision.step("local", worse * problem.noise)
        return Found(Errors(worse * problem.noise, None))

    monkeypatch.setattr(study, "train", train)
    monkeypatch.setattr(study, "load", lambda log: recording(FAST))
    monkeypatch.setattr(study, "offset", lambda problem, found: 0.0)
    monkeypatch.setattr(study.Supervision, "seconds", property(_clock(0.25)))
    found = study.run(order(tmp_path, 10, budget=1e9), 1, print)
    assert [t.state.name for t in found.trials[7:]] == ["PRUNED"] * 3


def _clock(step):
    times = {}

    def seconds(supervision):
        times[id(supervision)] = times.get(id(supervision), 0.0) + step
        return times[id(supervision)]

    return seconds


def test_the_command_writes_preset_summary_and_picture(trained, tmp_path):
    out = tmp_path / "tuned.json"
    tune([Path("a.mcap")], out, trials=12, budget=10.0, price=0.0, preset="local", workers=1, study=None, seed=1)
    assert read_settings(out).network == "local"
    assert json.loads(out.read_text())["levels"][-1]["physics"] > 5
    assert "| `physics` |" in out.with_suffix(".md").read_text()
    assert out.with_suffix(".png").stat().st_size > 1000


@pytest.mark.parametrize("preset", ["global", "paper"])
def test_the_other_networks_take_what_is_varied(preset):
    base = read_settings(preset)
    chosen = {
        "global": {
            "width": 12, "layers": 3, "without": "time", "samples": 1600, "first_physics": 1.0,
            "last_physics": 20.0, "steps": 80,
        },
        "paper": {
            "width": 32, "layers": 2, "phi_data": 10.0, "phi_phys": 0.1, "learning_rate": 1e-3, "samples": 512,
        },
    }[preset]  # fmt: skip
    made = settings_of(base, chosen)
    assert type(made).model_validate(made.model_dump()) == made
    assert made.width == chosen["width"]
