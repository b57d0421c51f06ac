"""Curve effects: those that a recording can show, with units and scales, and the variables of its pieces."""

from dataclasses import replace

import numpy as np
import pytest

from identification.damper.definitions import STAGE_OF, VARIABLES_AT
from identification.gap.discovery.curve_basis import MAX_GROWTH
from identification.gap.discovery.curve_effects import (
    CURVE_PLACES,
    CurvePlace,
    collect_variables,
    list_curve_effects,
    make_fine_curve,
)
from identification.simulate import ActiveEffect, DamperVariables, SimulationModel, make_coil_variables, simulate
from tests.support.discoveries import all_curves, make_curves, make_problem, make_stroke
from tests.support.effects import LABORATORY
from tests.support.fit_problems import SCALES

DRIVE_RESPONSE = CurvePlace("drive", ("drive_history",), is_response=True)
DELAY = CurvePlace("displacement_channel", ("time", "velocity"))
OVER_DRIVE = {at for at in CURVE_PLACES if at.variables[0] in ("drive", "drive_history")} - {DRIVE_RESPONSE}
WITH_DRIVE = {at for at in CURVE_PLACES if "drive" in at.variables[1:]}


def test_every_place_of_the_chain_is_tried_once_with_variables_that_exist_there():
    assert {at.place for at in CURVE_PLACES} == set(STAGE_OF)
    assert len(set(CURVE_PLACES)) == len(CURVE_PLACES)
    for at in CURVE_PLACES:
        assert set(at.variables) <= set(VARIABLES_AT[at.place])


@pytest.mark.parametrize(
    ("levels", "hidden"),
    [
        ((0.4,), OVER_DRIVE | WITH_DRIVE | {DRIVE_RESPONSE}),
        ((0.1, 0.5), OVER_DRIVE),
        ((0.1, 0.5, 0.105), OVER_DRIVE),  # two levels differ by a hundredth of the highest
        ((0.1, 0.5, 0.3), set()),
        ((0.1, 0.3, 0.5), {CurvePlace("field", ("drive_history",))}),  # the drive never turns
    ],
)
def test_a_curve_needs_three_levels_of_the_drive_and_its_factor_two(levels, hidden):
    assert set(CURVE_PLACES) - set(make_curves(make_stroke(levels))) == hidden


def test_a_spectral_line_adds_a_curve_that_repeats_with_its_period():
    stroke = make_stroke()
    forces = [1000.0 * stroke.velocity]
    added = [c for c in list_curve_effects(make_problem(stroke), forces, 125.0) if c.at not in CURVE_PLACES]
    assert [c.at for c in added] == [CurvePlace("force_channel", ("time",), period=0.008)]
    assert added[0].at.label == "periodic force_channel over time".replace("_", " ")
    values = np.random.default_rng(3).standard_normal(added[0].function.basis.size)
    time = stroke.start + np.arange(200) / 1000.0
    curve = added[0].function({"time": time}, *values)
    np.testing.assert_allclose(curve[8:], curve[:-8], atol=1e-9 * np.abs(curve).max())


def test_levels_may_be_in_different_pieces_but_a_response_needs_a_change_within_one():
    curves = make_curves(*(make_stroke((level,), seconds=0.5) for level in (0.1, 0.3, 0.5)))
    assert set(curves) == set(CURVE_PLACES) - {DRIVE_RESPONSE}


def test_a_variable_that_does_not_vary_has_no_curve():
    without_power = replace(make_stroke(), power=None)
    assert set(CURVE_PLACES) - set(make_curves(without_power)) == {
        CurvePlace("damper_gain", ("dissipated_energy",))
    }


def test_factors_of_a_curve_follow_from_its_variables():
    friction = CurvePlace("parallel_force", ("displacement", "velocity", "drive"), grows_with_drive=True)
    assert (friction.direction, friction.has_drive_factor) == ("sign", False)
    assert friction._replace(is_viscous=True).direction == "velocity"
    assert friction.label == "parallel force over displacement and velocity and drive"
    assert CurvePlace("drive", ("time", "drive")).has_drive_factor
    assert CurvePlace("parallel_force", ("velocity",)).direction == "none"
    assert DELAY.direction == "velocity"
    for at, curve in all_curves().items():
        flags = (curve.function.direction, curve.function.drive_factor, curve.function.grows_with_drive)
        assert flags == (at.direction, at.has_drive_factor, at.grows_with_drive)


@pytest.mark.parametrize(
    ("place", "unit", "stage"),
    [
        ("drive", "{drive}", "coil"),
        ("field", "{drive}", "coil"),
        ("damper_gain", "1", "damper"),
        ("parallel_force", "N", "damper"),
        ("mounting", "N", "mounting"),
        ("force_channel", "N", "force_channel"),
        ("displacement_channel", "m", "displacement_channel"),
    ],
)
def test_a_curve_has_unit_and_stage_of_its_place(place, unit, stage):
    curves = [c for at, c in all_curves().items() if at.place == place]
    other = ("is_viscous", "has_drive_factor", "is_elongation", "is_response", "is_delay")
    plain = [c for c in curves if not any(getattr(c.at, name) for name in other)]
    assert {c.unit for c in plain} <= {unit}
    assert {c.unit for c in curves if c.at.is_elongation} <= {"m"}
    assert {c.unit for c in curves if c.at.has_drive_factor} <= {"1"}
    assert {c.unit for c in curves if c.at.is_viscous} <= {"N s/m"}
    assert {c.unit for c in curves if c.at.is_delay} <= {"s"}
    assert {m.effect.stage for c in curves for m in (c.model, c.linear_model)} == {stage}
    assert {c.model.effect.variable for c in curves} == {c.at.variables[0] for c in curves}


@pytest.mark.parametrize(
    ("place", "factor"),
    [
        ("field", 3.0),
        ("damper_gain", 1.0),
        ("parallel_force", 100.0),
        ("mounting", 100.0),
        ("force_channel", 100.0),
        ("displacement_channel", 7.0),
    ],
)
def test_a_curve_of_unit_size_is_as_large_as_the_damper(place, factor):
    large = replace(
        SCALES, force=100.0 * SCALES.force, length=7.0 * SCALES.length, drive=3.0 * SCALES.drive, velocity=1.0
    )
    for at, curve in make_curves(make_stroke(), scales=large).items():
        if at.place == place and not (at.is_viscous or at.is_elongation or at.is_response or at.is_delay):
            assert curve.function.scale == pytest.approx(factor * all_curves()[at].function.scale), at
    sizes = {"field": 0.5, "damper_gain": 1.0, "displacement_channel": 0.01}
    assert all_curves()[next(at for at in all_curves() if at.place == place)].function.scale == sizes.get(
        place, 200.0
    )


def test_an_elongation_of_unit_size_is_as_large_as_the_stroke():
    (elongation,) = (c for at, c in all_curves().items() if at.is_elongation)
    assert elongation.at == CurvePlace("mounting", ("force",))
    assert elongation.function.scale == SCALES.length


def test_a_viscous_curve_of_unit_size_is_as_large_as_the_damping():
    viscous = {at: c for at, c in all_curves().items() if at.is_viscous}
    assert viscous
    assert {c.function.scale for c in viscous.values()} == {SCALES.damping}


def test_a_fine_curve_follows_changes_that_a_curve_does_not():
    problem, at = make_problem(make_stroke(seconds=30.0)), CurvePlace("drive", ("time", "drive"))
    time = problem.pieces[0].excitation.time
    wave = np.sin(2.0 * np.pi * time / 4.0)
    coarse, fine = make_curves(make_stroke(seconds=30.0))[at], make_fine_curve(problem, at)
    left = []
    for basis in (coarse.function.basis, fine.function.basis):
        columns = np.stack([np.interp(time, basis.positions, row) for row in basis.table], axis=1)
        left.append(np.std(wave - columns @ np.linalg.lstsq(columns, wave, rcond=None)[0]) / np.std(wave))
    assert left[0] > 0.5
    assert left[1] < 0.1
    assert (fine.unit, fine.function.scale, fine.at.label) == (coarse.unit, coarse.function.scale, at.label)


def test_a_delay_that_varies_has_the_size_of_a_part_of_a_cycle():
    fast = replace(SCALES, velocity=4.0 * SCALES.velocity)
    sizes = [make_curves(make_stroke(), scales=scales)[DELAY].function.scale for scales in (SCALES, fast)]
    assert sizes == pytest.approx([SCALES.length / SCALES.velocity, SCALES.length / fast.velocity])


def test_a_curve_that_is_proportional_to_the_drive_is_relative_to_it():
    # Its values are parts of the drive, and have no unit, whatever the size of the drive.
    at = CurvePlace("drive", ("time", "drive"))
    assert all_curves()[at].function.scale == 1.0
    assert make_curves(make_stroke(), scales=replace(SCALES, drive=3.0))[at].function.scale == 1.0


def test_growth_is_limited_so_that_the_curve_keeps_its_sign_up_to_the_highest_drive():
    for at, curve in all_curves().items():
        symbols = [q.symbol for q in curve.model.quantities]
        assert ("growth" in symbols) == at.grows_with_drive
        count = curve.function.basis.size
        assert len(curve.linear_model.quantities) == count * (2 if at.grows_with_drive else 1)
        if at.grows_with_drive:
            growth = curve.model.quantities[-1]
            assert (growth.low, growth.high) == pytest.approx((-0.95 / SCALES.drive, MAX_GROWTH / SCALES.drive))
            assert 1.0 + growth.low * SCALES.drive > 0.0
            assert growth.format_unit("V") == "1/V"


def test_curves_that_start_at_zero_leave_the_force_as_it_is():
    stroke = make_stroke(seconds=0.3)
    plain = simulate(SimulationModel(LABORATORY), stroke).force
    for curve in make_curves(stroke).values():
        for model in (curve.model, curve.linear_model):
            (values,) = model.starts
            effect = ActiveEffect(model.effect, values, model.form_name)
            force = simulate(SimulationModel(LABORATORY, effects=(effect,)), stroke).force
            if curve.at.is_elongation:
                # On a stiff mount the damper has its velocity from the second sample on.
                assert np.sqrt(np.mean((force - plain)[2:] ** 2)) < 0.01 * plain.std()
            else:
                np.testing.assert_allclose(force, plain, rtol=1e-12)


@pytest.mark.parametrize("at", CURVE_PLACES, ids=lambda at: at.label)
def test_every_coefficient_changes_the_force_as_its_sensitivity_says(at):
    stroke = make_stroke(seconds=0.3)
    curve = make_curves(stroke)[at]
    values = np.random.default_rng(3).normal(0.0, 0.002, len(curve.model.quantities))

    def run(values, **more):
        effect = ActiveEffect(curve.model.effect, tuple(values), curve.model.form_name)
        return simulate(SimulationModel(LABORATORY, effects=(effect,)), stroke, **more)

    J = run(values, sensitivities=True).sensitivities[:, -len(values) :]
    # Where an elongation does not increase, some coefficients change nothing.
    active = np.flatnonzero(np.abs(J).max(axis=0))
    assert len(active) >= len(values) // 2
    for k in (active[0], active[len(active) // 2], active[-1]):
        move = np.zeros(len(values))
        # Where an elongation stops to increase, its force has a corner, which a larger step would cross.
        step = move[k] = 1e-7 if at.is_elongation else 1e-5
        change = (run(values + move).force - run(values - move).force) / (2.0 * step)
        # The force at a mounting is solved to about 1e-8 N.
        solved = 1e-8 / step if at.is_elongation else 0.0
        assert np.sqrt(np.mean((change - J[:, k]) ** 2)) < 0.02 * np.sqrt(np.mean(change**2)) + solved


def test_variables_are_those_of_every_piece_one_after_the_other():
    strokes = make_stroke((0.0, 0.3)), replace(make_stroke((0.5, 0.2), size=0.005), start=30.0)
    forces = [np.full(len(s.drive), f) for s, f in zip(strokes, (1.0, 2.0), strict=True)]
    found = collect_variables(make_problem(*strokes).pieces, forces)
    assert set(found) == {name for at in CURVE_PLACES for name in at.variables}
    parts = {name: np.split(values, 2) for name, values in found.items()}
    for i, s in enumerate(strokes):
        damper = DamperVariables(s, s.displacement, s.velocity, s.acceleration)
        coil = make_coil_variables(s.drive, s.start, 1.0 / s.rate)
        for name in set(found) - {"force", "drive_history"}:
            np.testing.assert_array_equal(parts[name][i], damper[name], err_msg=name)
        np.testing.assert_array_equal(parts["drive_history"][i], coil["drive_history"])
        np.testing.assert_array_equal(parts["force"][i], forces[i])
    # No variable of the past goes on into the next piece.
    assert parts["travel_since_rest"][1][0] == parts["dissipated_energy"][1][0] == 0.0
    assert parts["time"][1][0] == 30.0
