"""Tuning studies: better settings, pruning, continued studies and their summary."""

import json
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import optuna
import pytest

from identification.commands.tune import tune
from identification.damper.coordinates import Coordinates
from identification.errors import IdentificationError
from identification.fitting.dataset import assemble
from identification.fitting.output_error import fit_output_error
from identification.fitting.unknown_layout import COORDINATE_COUNT
from identification.pinn.common.result import ForceErrors
from identification.pinn.common.settings import read_settings
from identification.pipeline import make_problem
from identification.tuning import study
from identification.tuning.offset import estimate_offset
from identification.tuning.space import apply_values, extract_values
from identification.tuning.summary import compute_importances, format_summary
from tests.support.laboratory import FAST, recording

pytestmark = pytest.mark.filterwarnings("ignore::optuna.exceptions.ExperimentalWarning")


@dataclass
class FakeResult:
    simulation: ForceErrors
    seconds: float = 1.0
    accepted: bool = True


@dataclass
class FakeEstimate:
    coordinates: Coordinates
    delays: tuple[float, float]


@pytest.fixture
def trained(monkeypatch):
    """Replace trainings: the error is least at a law weight of 50 and a rank of 40. Yield the settings of each."""
    settings_of_trials = []

    def train(problem, settings, monitor):
        stage, layer = settings.schedule[-1], settings.layers[0]
        error = problem.noise * (1 + 0.1 * abs(stage.law_weight / 50 - 1) + 0.01 * abs(layer.rank - 40))
        settings_of_trials.append(settings)
        monitor.report("fake", error)
        return FakeResult(ForceErrors(error, error))

    monkeypatch.setattr(study, "train", train)
    monkeypatch.setattr(study, "load", lambda log: recording(FAST))
    monkeypatch.setattr(study, "estimate_offset", lambda problem, result: 0.0)
    return settings_of_trials


def make_request(folder, trials, **changes):
    defaults = {
        "logs": (Path("a.mcap"),),
        "preset": "elements",
        "study": folder / "s.db",
        "budget": 10.0,
        "time_weight": 0.0,
    }
    return study.StudyRequest(**(defaults | {"trials": trials, "seed": 1} | changes))


def test_a_study_finds_better_settings_than_its_first_ones(trained, tmp_path):
    messages = []
    finished = study.run_study(make_request(tmp_path, 25), 1, messages.append)
    values = [t.value for t in finished.trials]
    assert len(trained) == len(messages) == 25
    assert min(values) < 0.93 * max(values)
    assert min(values[15:]) <= min(values[:5])
    best = study.get_best_settings(finished, "elements")
    assert best.schedule[-1].law_weight == finished.best_params["physics"]
    larger = (s for s in read_settings("elements").layers[1:] if s.rank > best.layers[0].rank)
    assert best.layers[1:] == tuple(larger)
    importances = compute_importances(finished)
    assert len(importances) == len(finished.best_params)
    assert {"law_weight", "decimation", "multiplier_steps", "element_input", "rank"} < set(importances)


def test_a_study_is_continued_where_it_stopped(trained, tmp_path):
    study.run_study(make_request(tmp_path, 3), 1, print)
    continued = study.run_study(make_request(tmp_path, 5), 1, print)
    assert len(trained) == 5
    assert [t.number for t in continued.trials] == [0, 1, 2, 3, 4]


def test_a_study_with_former_names_is_continued(trained, tmp_path):
    request = make_request(tmp_path, 3)
    former = optuna.create_study(storage=request.storage, study_name="local")
    former.set_user_attr("logs", ["a.mcap"])
    former.set_user_attr("preset", "local")
    former.enqueue_trial(
        {
            "units": 160, "rank": 40, "points": 76, "physics": 30.0, "meshes": 6, "thin": 2, "multipliers": 3,
            "activation": "tanh", "features": "slip",
        }
    )  # fmt: skip
    continued = study.run_study(request, 1, print)
    assert optuna.get_all_study_names(request.storage) == ["local"]
    assert trained[0] == read_settings("elements")
    assert len(study.run_study(make_request(tmp_path, 4, preset="local"), 1, print).trials) == 4
    summary = format_summary(continued, "{}", {}, None)
    assert "# Tuning of the network `elements`" in summary
    assert "preset `elements`" in summary
    assert "`law_weight`" in summary


@pytest.mark.parametrize("preset", ["elements", "dense", "paper"])
def test_a_study_begins_with_the_preset_itself(trained, tmp_path, preset):
    settings = read_settings(preset)
    assert apply_values(settings, extract_values(settings)) == settings
    if preset == "elements":
        study.run_study(make_request(tmp_path, 1), 1, print)
        assert trained[0] == settings


def test_the_objective_of_several_dampers_is_their_mean(trained, monkeypatch, tmp_path):
    monkeypatch.setattr(study, "estimate_offset", lambda problem, result: 3**0.5 * (len(trained) - 1))
    request = make_request(tmp_path, 1, logs=(Path("a.mcap"), Path("b.mcap")), time_weight=0.25)
    (trial,) = study.run_study(request, 1, print).trials
    assert len(trained) == 2
    assert trial.user_attrs["offset"] == pytest.approx(3**0.5 / 2)
    # The offset of the second damper doubles an error of one standard deviation.
    assert trial.value == pytest.approx(trial.user_attrs["error"] + 0.5 + 0.25)


def test_the_offset_is_the_distance_from_the_best_simulated_fit_in_deviations():
    problem = make_problem(assemble([recording(FAST)]))
    best = fit_output_error(problem)
    free = problem.free_mask & (np.arange(len(problem.free_mask)) < COORDINATE_COUNT)
    covariance = np.linalg.inv(best.evaluation.hessian[np.ix_(problem.free_mask, problem.free_mask)])
    deviations = np.sqrt(np.diag(covariance)[: free.sum()])
    for distance in (0.0, 0.5):
        unknowns = best.unknowns.copy()
        unknowns[free] += distance * deviations * (-1.0) ** np.arange(free.sum())
        delays = tuple(unknowns[COORDINATE_COUNT:][:2] * problem.delay_prior)
        estimate = FakeEstimate(problem.space.to_coordinates(unknowns[:COORDINATE_COUNT]), delays)
        assert estimate_offset(problem, estimate) == pytest.approx(distance, rel=0.15, abs=0.1)


def test_a_study_of_other_logs_is_refused(trained, tmp_path):
    study.run_study(make_request(tmp_path, 1), 1, print)
    with pytest.raises(IdentificationError, match="contains a study of"):
        study.run_study(make_request(tmp_path, 2, logs=(Path("b.mcap"),)), 1, print)


def test_a_study_of_another_preset_is_refused(trained, tmp_path):
    study.run_study(make_request(tmp_path, 1), 1, print)
    with pytest.raises(IdentificationError, match="contains a study of"):
        study.run_study(make_request(tmp_path, 2, preset="tuned"), 1, print)


def test_the_time_weight_adds_to_the_objective(trained, tmp_path):
    without = study.run_study(make_request(tmp_path, 1), 1, print).best_value
    request = make_request(tmp_path, 1, study=tmp_path / "t.db", time_weight=0.5)
    assert study.run_study(request, 1, print).best_value == pytest.approx(without + 0.5)


def test_a_trial_that_is_worse_than_the_others_is_pruned(monkeypatch, tmp_path):
    count = iter(range(100))

    def train(problem, settings, monitor):
        """Every later training is ten times worse than the first ones, which are never pruned."""
        factor = 1.0 if next(count) < 7 else 10.0
        for _ in range(40):
            monitor.report("fake", factor * problem.noise)
        return FakeResult(ForceErrors(factor * problem.noise, None))

    monkeypatch.setattr(study, "train", train)
    monkeypatch.setattr(study, "load", lambda log: recording(FAST))
    monkeypatch.setattr(study, "estimate_offset", lambda problem, result: 0.0)
    monkeypatch.setattr(study.TrainingMonitor, "seconds", property(make_clock(0.25)))
    finished = study.run_study(make_request(tmp_path, 10, budget=1e9), 1, print)
    assert [t.state.name for t in finished.trials[7:]] == ["PRUNED"] * 3


def make_clock(step):
    times = {}

    def seconds(monitor):
        times[id(monitor)] = times.get(id(monitor), 0.0) + step
        return times[id(monitor)]

    return seconds


def test_the_command_writes_preset_summary_and_plot(trained, tmp_path):
    out = tmp_path / "tuned.json"
    tune(
        [Path("a.mcap")],
        out,
        trials=12,
        budget=10.0,
        time_weight=0.0,
        preset="elements",
        workers=1,
        study=None,
        seed=1,
    )
    assert read_settings(out).network == "elements"
    assert json.loads(out.read_text())["schedule"][-1]["law_weight"] > 5
    assert "| `law_weight` |" in out.with_suffix(".md").read_text()
    assert out.with_suffix(".png").stat().st_size > 1000


@pytest.mark.parametrize(
    ("preset", "values"),
    [
        (
            "dense",
            {
                "width": 12, "layers": 3, "without": "time", "samples": 1600, "first_physics": 1.0,
                "last_physics": 20.0, "steps": 80,
            },
        ),
        (
            "paper",
            {
                "width": 32, "layers": 2, "phi_data": 10.0, "phi_phys": 0.1, "learning_rate": 1e-3, "samples": 512,
            },
        ),
    ],
)  # fmt: skip
def test_values_of_a_study_become_valid_settings_of_the_other_networks(preset, values):
    settings = apply_values(read_settings(preset), values)
    assert type(settings).model_validate(settings.model_dump()) == settings
    assert settings.width == values["width"]


@pytest.mark.parametrize(
    ("error", "offset", "time_weight", "value"),
    [(1.2, 0.0, 0.0, 1.2), (1.2, 0.75, 0.0, 1.45), (1.2, 0.75, 0.1, 1.95), (500.0, 0.0, 0.1, 100.5)],
)
def test_the_objective_adds_error_offset_and_time(error, offset, time_weight, value):
    # An offset of 0.75 adds sqrt(1 + 0.75^2) - 1 = 0.25.
    assert study.TrialResult(error, offset, 5.0).compute_value(time_weight) == pytest.approx(value)


def test_a_trial_reports_the_error_over_the_noise_once_in_half_a_second():
    reports = []
    trial = SimpleNamespace(report=lambda value, step: reports.append((value, step)), should_prune=lambda: False)
    monitor = study._TrialMonitor(trial, 2.0, 100_000)
    for seconds, error in ((0.1, 6.0), (0.4, 5.0), (0.6, float("nan")), (0.7, 4.0), (2.1, 3.0)):
        monitor.clock = lambda seconds=seconds: seconds
        monitor.report("", error)
    assert reports == [(3.0, 100_000), (2.0, 100_001), (1.5, 100_004)]
    assert not monitor.should_stop()
    trial.should_prune = lambda: True
    assert monitor.should_stop()
    trial.should_prune = lambda: False
    assert monitor.should_stop()  # once pruned, it stays so


@pytest.mark.parametrize(
    ("state", "attributes", "text"),
    [
        (optuna.trial.TrialState.PRUNED, {}, "trial 3: pruned"),
        (optuna.trial.TrialState.COMPLETE, {}, "trial 3: no parameters found"),
        (
            optuna.trial.TrialState.COMPLETE,
            {"error": 1.25, "offset": 0.5, "seconds": 7.0},
            "trial 3: 1.2500 of the noise, 0.50 deviations off, 7.0 s",
        ),
    ],
)
def test_a_trial_is_described_in_one_line(state, attributes, text):
    assert study._describe_trial(SimpleNamespace(number=3, state=state, user_attrs=attributes)) == text


@pytest.mark.parametrize(("gradient", "offset"), [([2.0, 0.0], np.sqrt(0.5)), ([1e6, 0.0], 100.0)])
def test_the_offset_is_the_root_mean_square_step_in_deviations_and_limited(gradient, offset):
    # Information 4 gives a deviation of 1/2; a gradient of 2 a step of 1/2. The delay is not counted.
    information = np.diag([4.0] * 2 + [9.0])
    evaluation = SimpleNamespace(cost=1.0, hessian=np.zeros((15, 15)), gradient=np.zeros(15))
    free = np.zeros(15, bool)
    free[[0, 1, 13]] = True
    evaluation.hessian[np.ix_(free, free)] = information
    evaluation.gradient[free] = [*gradient, 7.0]
    starts = []
    problem = SimpleNamespace(
        make_start=lambda coordinates: np.zeros(15), layout=SimpleNamespace(delays=slice(13, 15)),
        delay_prior=1e-5, free_mask=free, evaluate=lambda unknowns: starts.append(unknowns) or evaluation,
    )  # fmt: skip
    result = SimpleNamespace(coordinates=None, delays=(2e-5, -1e-5))
    assert estimate_offset(problem, result) == pytest.approx(offset)
    assert starts[0][13:] == pytest.approx([2.0, -1.0])
    evaluation.cost = np.inf
    assert estimate_offset(problem, result) == 100.0
