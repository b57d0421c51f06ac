"""Budget of a fit: its text, its limits, and its effect on the number of starts."""

import numpy as np
import pytest

from identification.errors import IdentificationError
from identification.fitting import output_error
from identification.fitting.budget import Budget, EffortMeter
from identification.fitting.output_error import OptimiserSettings, fit_output_error
from tests.support.short_fit import fitted


@pytest.mark.parametrize(
    ("text", "budget"),
    [("", Budget()), ("500", Budget(steps=500)), ("60s", Budget(seconds=60.0)), ("0.5s", Budget(seconds=0.5))],
)
def test_the_text_of_a_budget_is_read_and_written(text, budget):
    assert Budget.from_text(text) == budget
    assert str(budget) == text


@pytest.mark.parametrize("text", ["0", "0s", "-5", "5 s", "1m", "s", "1e3", "1.5"])
def test_another_text_is_refused_with_both_ways_to_state_it(text):
    with pytest.raises(IdentificationError, match=r"number of steps such as `500`, or a processor time"):
        Budget.from_text(text)


@pytest.mark.parametrize(
    ("budget", "steps", "seconds", "spent"),
    [
        (Budget(), 10**9, 1e9, False),
        (Budget(steps=5), 4, 1e9, False),
        (Budget(steps=5), 5, 0.0, True),
        (Budget(seconds=2.0), 10**9, 2.0, False),
        (Budget(seconds=2.0), 0, 2.1, True),
    ],
)
def test_a_budget_is_spent_at_its_own_limit_only(budget, steps, seconds, spent):
    assert budget.is_spent(steps, seconds) == spent


def test_the_meter_counts_reports_and_passes_them_on():
    reports = []
    meter = EffortMeter(Budget(steps=2), lambda message, error: reports.append((message, error)))
    assert not meter.is_spent
    meter.report("refine", 3.0)
    meter.report("refine", 2.0)
    assert reports == [("refine", 3.0), ("refine", 2.0)]
    assert meter.is_spent


@pytest.mark.parametrize(("steps", "starts"), [(1, 1), (10**6, 3)])
def test_no_further_start_is_tried_after_the_steps_are_spent(monkeypatch, steps, starts):
    tried = []

    def minimise(problem, start, iterations, progress, held=None, tolerance=0.0):
        tried.append(start)
        progress("refine", 1.0)
        return output_error.Minimum(start, type("Here", (), {"cost": float(len(tried))})(), 1, converged=True)

    monkeypatch.setattr(output_error, "minimise", minimise)
    monkeypatch.setattr(output_error, "_decimate_for_preview", lambda problem: problem)
    monkeypatch.setattr(output_error, "make_starting_points", lambda problem: [np.zeros(2)])
    monkeypatch.setattr(output_error, "_minimise_preview", lambda preview, start, iterations, progress: start)
    monkeypatch.setattr(output_error, "_is_conclusive", lambda problem, minimum: False)
    monkeypatch.setattr(output_error, "_generate_restarts", lambda *given: iter([np.ones(2)] * 5))
    fit_output_error(None, OptimiserSettings(restarts=2, budget=Budget(steps=steps)))
    assert len(tried) == starts


@pytest.mark.parametrize(
    ("budget", "text", "reproducible"), [("", None, True), ("900", "900", True), ("9s", "9s", False)]
)
def test_a_document_states_its_budget_and_whether_it_can_be_reproduced(budget, text, reproducible):
    settings = fitted("refine", budget=budget).provenance.settings
    assert (settings["budget"], settings["reproducible"]) == (text, reproducible)
