"""Several logs of one specimen: one damper, and what each log has of its own."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_identify import LABORATORY, NOISE, recording, stretch
from typer.testing import CliRunner

from identification.assemble import assemble
from identification.condition import Condition
from identification.errors import IdentificationError
from identification.identify import Request, fit_problem, identify
from identification.simulate import Setting, Stroke, simulate

WARMER, SHIFT = 0.85, 12.0


def day(name, made, condition):
    """A log of another day: the damper under its condition."""
    t = made.time
    g = made.segments[0]
    w = 2 * np.pi * g.frequency
    x = g.amplitude * np.sin(w * t)
    stroke = Stroke(made.rate, x, g.amplitude * w * np.cos(w * t), -w * w * x, made.drive)
    force = simulate(Setting(condition.of(LABORATORY)), stroke, fineness=0.005).force
    noisy = force + NOISE * np.random.default_rng(len(name)).standard_normal(len(t))
    return replace(recording(replace(made, force=noisy)), path=Path(name))


MONDAY = recording(stretch("slow", 0.010, 1.0, 1), stretch("fast", 0.005, 2.5, 2))
MONDAY_AGAIN = day("again.mcap", stretch("later", 0.012, 1.5, 3), Condition())
FRIDAY = day("friday.mcap", stretch("later", 0.012, 1.5, 3), Condition(SHIFT, WARMER))


def test_what_a_log_has_of_its_own_is_found_and_the_damper_with_it():
    fit = identify([MONDAY, FRIDAY], Request(own=("offset", "viscosity")))
    own = fit.nuisances.each_log["friday.mcap"]
    assert own["offset"].ci99[0] < SHIFT < own["offset"].ci99[1]
    assert own["viscosity"].ci99[0] < WARMER < own["viscosity"].ci99[1]
    assert own["viscosity"].value == pytest.approx(WARMER, rel=0.01)
    assert fit.rmse_n.train == pytest.approx(NOISE, rel=0.03)
    assert fit.coordinates["c0_a"].value == pytest.approx(LABORATORY.c0_a, rel=0.02)
    assert fit.notes == []
    assert fit.provenance.settings["free"] == "offset,viscosity"


def test_the_network_alone_finds_it_too():
    fit = identify([MONDAY, FRIDAY], Request(own=("offset", "viscosity"), stages=("pinn",)))
    own = fit.nuisances.each_log["friday.mcap"]
    assert own["offset"].ci99[0] < SHIFT < own["offset"].ci99[1]
    assert own["viscosity"].ci99[0] < WARMER < own["viscosity"].ci99[1]
    assert fit.rmse_n.train == pytest.approx(NOISE, rel=0.03)
    (stage,) = fit.stages
    assert stage.simulated_n.validation == pytest.approx(NOISE, rel=0.1)


def test_the_network_is_a_witness_where_logs_differ():
    fit = identify([MONDAY, FRIDAY], Request(own=("offset", "viscosity"), stages=("pinn", "refine")))
    assert fit.agreement.startswith("agree: pinn and refine")


def test_a_network_that_knows_one_condition_says_so_and_the_fit_goes_on():
    request = Request(own=("offset",), stages=("pinn", "refine"), preset="paper")
    fit = identify([MONDAY, MONDAY_AGAIN], request)
    assert "one damper in one condition" in fit.agreement
    assert fit.rmse_n.train == pytest.approx(NOISE, rel=0.03)


def test_without_it_the_fit_says_which_log_does_not_belong():
    fit = identify([MONDAY, FRIDAY])
    assert "times the noise floor" in fit.result
    assert fit.nuisances.each_log == {}


def test_slopes_over_what_a_log_has_of_its_own_are_exact():
    problem = replace(fit_problem(assemble([MONDAY, FRIDAY])), own=("offset", "viscosity"))
    unknowns = problem.start(LABORATORY)
    unknowns[-2:] = (0.4, -0.5)
    _, J = problem.residuals(unknowns, 2)
    assert problem.columns(2)[-2:] == [problem.first_own, problem.first_own + 1]
    for k in (1, 2, 6, 8, 12, *problem.columns(2)[-2:]):
        move = np.zeros(len(unknowns))
        move[k] = 1e-5
        after, before = (problem.residuals(unknowns + s * move, 2)[0] for s in (1, -1))
        column = J[:, problem.columns(2).index(k)]
        np.testing.assert_allclose(column, (after - before) / 2e-5, atol=2e-4 * np.abs(column).max())


def test_the_first_log_has_nothing_of_its_own():
    problem = replace(fit_problem(assemble([MONDAY, FRIDAY])), own=("offset",))
    assert problem.own_count == 1
    assert [len(problem.columns(i)) for i in range(3)] == [16, 16, 17]


@pytest.mark.parametrize(
    ("free", "words"), [("A", r"leaves every force as it is"), ("D_y", "every parameter is free already")]
)
def test_what_no_force_reveals_is_never_freed(free, words, tmp_path):
    from bench.cli import _application, entry_points

    app = _application(entry_points(group="mrbench.commands").select(name="identify"))
    found = CliRunner().invoke(app, ["identify", "x.mcap", "--out", str(tmp_path / "f.json"), "--free", free])
    assert isinstance(found.exception, IdentificationError)
    assert words in str(found.exception)
