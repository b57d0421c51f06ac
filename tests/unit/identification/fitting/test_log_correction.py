"""Several logs of one specimen: one damper with per-log parameters."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from identification.errors import IdentificationError
from identification.fitting.dataset import assemble
from identification.fitting.log_correction import LogCorrection
from identification.pipeline import FitRequest, identify, make_problem
from identification.simulate import Excitation, SimulationModel, simulate
from tests.support.laboratory import LABORATORY, NOISE, recording, stretch

WARMER, SHIFT = 0.85, 12.0


def day(name, template, correction):
    """A log of another day, with a corrected damper."""
    t = template.time
    g = template.segments[0]
    w = 2 * np.pi * g.frequency
    x = g.amplitude * np.sin(w * t)
    stroke = Excitation(template.rate, x, g.amplitude * w * np.cos(w * t), -w * w * x, template.drive)
    force = simulate(SimulationModel(correction.apply(LABORATORY)), stroke, max_travel=0.005).force
    noisy = force + NOISE * np.random.default_rng(len(name)).standard_normal(len(t))
    return replace(recording(replace(template, force=noisy)), path=Path(name))


MONDAY = recording(stretch("slow", 0.010, 1.0, 1), stretch("fast", 0.005, 2.5, 2))
MONDAY_AGAIN = day("again.mcap", stretch("later", 0.012, 1.5, 3), LogCorrection())
FRIDAY = day("friday.mcap", stretch("later", 0.012, 1.5, 3), LogCorrection(SHIFT, WARMER))


def test_per_log_parameters_are_found_together_with_the_damper():
    fit = identify([MONDAY, FRIDAY], FitRequest(per_log=("offset", "viscosity")))
    parameters = fit.nuisances.per_log["friday.mcap"]
    assert parameters["offset"].ci99[0] < SHIFT < parameters["offset"].ci99[1]
    assert parameters["viscosity"].ci99[0] < WARMER < parameters["viscosity"].ci99[1]
    assert parameters["viscosity"].value == pytest.approx(WARMER, rel=0.01)
    assert fit.rmse_n.train == pytest.approx(NOISE, rel=0.03)
    assert fit.coordinates["c0_a"].value == pytest.approx(LABORATORY.c0_a, rel=0.02)
    assert fit.notes == []
    assert fit.provenance.settings["free"] == "offset,viscosity"


def test_the_network_alone_finds_them_too():
    fit = identify([MONDAY, FRIDAY], FitRequest(per_log=("offset", "viscosity"), stages=("pinn",)))
    parameters = fit.nuisances.per_log["friday.mcap"]
    assert parameters["offset"].ci99[0] < SHIFT < parameters["offset"].ci99[1]
    assert parameters["viscosity"].ci99[0] < WARMER < parameters["viscosity"].ci99[1]
    assert fit.rmse_n.train == pytest.approx(NOISE, rel=0.03)
    (stage,) = fit.stages
    assert stage.simulated_n.validation == pytest.approx(NOISE, rel=0.1)


def test_the_network_agrees_where_logs_differ():
    fit = identify([MONDAY, FRIDAY], FitRequest(per_log=("offset", "viscosity"), stages=("pinn", "refine")))
    assert fit.agreement.startswith("agree: pinn and refine")


def test_a_network_without_per_log_parameters_is_reported_and_the_fit_continues():
    request = FitRequest(per_log=("offset",), stages=("pinn", "refine"), preset="paper")
    fit = identify([MONDAY, MONDAY_AGAIN], request)
    assert "one damper in one condition" in fit.agreement
    assert fit.rmse_n.train == pytest.approx(NOISE, rel=0.03)


def test_without_per_log_parameters_the_fit_reports_the_misfit():
    fit = identify([MONDAY, FRIDAY])
    assert "times the noise floor" in fit.result
    assert fit.nuisances.per_log == {}


def test_derivatives_over_per_log_parameters_are_exact():
    problem = replace(make_problem(assemble([MONDAY, FRIDAY])), per_log=("offset", "viscosity"))
    unknowns = problem.make_start(LABORATORY)
    unknowns[-2:] = (0.4, -0.5)
    _, J = problem.compute_residuals(unknowns, 2)
    assert problem.find_columns(2)[-2:] == list(range(problem.layout.per_log.start, problem.layout.size))
    for k in (1, 2, 6, 8, 12, *problem.find_columns(2)[-2:]):
        move = np.zeros(len(unknowns))
        move[k] = 1e-5
        after, before = (problem.compute_residuals(unknowns + s * move, 2)[0] for s in (1, -1))
        column = J[:, problem.find_columns(2).index(k)]
        np.testing.assert_allclose(column, (after - before) / 2e-5, atol=2e-4 * np.abs(column).max())


def test_the_first_log_has_no_per_log_parameters():
    problem = replace(make_problem(assemble([MONDAY, FRIDAY])), per_log=("offset",))
    assert problem.layout.per_log_count == 1
    assert [len(problem.find_columns(i)) for i in range(3)] == [16, 16, 17]


@pytest.mark.parametrize(
    ("free", "reason"),
    [("A", r"leaves every force unchanged"), ("D_y", "every parameter of the damper is free already")],
)
def test_unobservable_and_shared_parameters_cannot_be_freed_per_log(free, reason, tmp_path):
    from bench.cli import _make_application, entry_points

    app = _make_application(entry_points(group="mrbench.commands").select(name="identify"))
    result = CliRunner().invoke(app, ["identify", "x.mcap", "--out", str(tmp_path / "f.json"), "--free", free])
    assert isinstance(result.exception, IdentificationError)
    assert reason in str(result.exception)
