"""Recorded changes by defined effects at every place, against their analytic values.

The actuator is stiff and the amplifier fast, so that the motion and the drive do not depend on the effect.
"""

import json
from typing import NamedTuple

import numpy as np
import pytest

from sim_rig.plant.plant import Plant, TrueSignals
from sim_rig.scenario.scenario import Scenario, load_scenario, parse_scenario
from sim_rig.sensors.channels import compute_true_values, make_readings
from tests.unit.sim_rig.definitions import define

STEP, SUBSTEPS = 1e-3, 8
TIME = np.arange(2000) * STEP
FINE = np.arange(2000 * SUBSTEPS) * STEP / SUBSTEPS
COMMAND = 0.01 * np.sin(3 * np.pi * TIME) * np.clip(TIME / 0.3, 0.0, 1.0) ** 3
DRIVE = np.array([0.1, 0.4, 0.2, 0.5])[(TIME / 0.5).astype(int)]
LAW = load_scenario("ideal").parameters
COIL_LAG = {"name": "coil_lag", "form": "dead_time", "parameters": {"delay": 4e-3}}
HEATING = {
    "name": "viscous_heating",
    "form": "viscosity_only",
    "parameters": {"softening": 0.0, "recovery_time": 2.0},
}


class Run(NamedTuple):
    truth: TrueSignals
    force: np.ndarray
    displacement: np.ndarray


def make_scenario(*effects, stiffness=1e12, **changes) -> Scenario:
    document = load_scenario("ideal").model_dump(mode="json", by_alias=True) | changes
    document["actuator"] |= {"stiffness": stiffness}
    document["amplifier"] |= {"bandwidth": 1e5}
    return parse_scenario(json.dumps({**document, "effects": effects}), "of a test")


def play(*effects, command=COMMAND, drive=DRIVE, **changes) -> Run:
    scenario = make_scenario(*effects, **changes)
    truth = Plant(scenario, command[0], drive[0]).simulate(STEP, np.append(command, command[-1]), drive)
    values = compute_true_values(scenario, truth, 0.0, STEP)
    return Run(truth, values["force"], values["displacement"])


@pytest.fixture(scope="module")
def plain():
    return play()


def play_with(plain, *arguments, **values):
    """Return the run with a defined effect, and the change of its recorded force."""
    run = play(define(*arguments, **values))
    return run, run.force - plain.force


def assert_close(found, expected, tolerance):
    """Check that the largest error is below a tolerance, and that the expected values exceed it by far."""
    assert np.abs(expected).max() > 50 * tolerance
    assert np.abs(found - expected).max() < tolerance


def change_law(**factors):
    return {"damper": LAW._replace(**{name: getattr(LAW, name) * f for name, f in factors.items()})._asdict()}


def offset_field(value):
    """Return a law that has at a field u the force of the usual one at u + value."""
    names = ("alpha", "c0", "c1")
    return change_law(**{f"{n}_a": 1 + value * getattr(LAW, f"{n}_b") / getattr(LAW, f"{n}_a") for n in names})


# Places.


def test_a_parallel_force_adds_to_the_force(plain):
    run, change = play_with(plain, "parallel_force", "a*tanh(velocity/s)", ["velocity"], a=20.0, s=0.03)
    assert_close(change, 20.0 * np.tanh(run.truth.velocity / 0.03), 1e-3)


def test_a_gain_is_a_factor_on_alpha_c0_and_c1(plain):
    _, change = play_with(plain, "damper_gain", "g", ["velocity"], g=0.1)
    names = ("alpha_a", "alpha_b", "c0_a", "c0_b", "c1_a", "c1_b")
    assert_close(change, play(**change_law(**dict.fromkeys(names, 1.1))).force - plain.force, 1e-6)


def test_a_function_of_the_field_adds_to_it(plain):
    _, change = play_with(plain, "field", "b", ["drive"], b=0.15)
    assert_close(change, play(**offset_field(0.15)).force - plain.force, 1e-4)


def test_the_variable_of_the_field_is_the_field_itself(plain):
    _, change = play_with(plain, "field", "g*drive", ["drive"], g=0.2)
    assert_close(change, play(**change_law(alpha_b=1.2, c0_b=1.2, c1_b=1.2)).force - plain.force, 1e-4)


def test_a_function_of_the_drive_adds_to_it_before_the_lag(plain):
    run, _ = play_with(plain, "drive", "b*sin(w*time)", ["time"], b=0.05, w=60.0)
    lag = LAW.eta / (LAW.eta + 60j)
    settled = np.imag(lag * np.exp(60j * TIME))
    response = 0.05 * (settled - settled[0] * np.exp(-LAW.eta * TIME))
    assert_close(run.truth.field - plain.truth.field, response, 1e-5)


@pytest.mark.parametrize("others", [(), (COIL_LAG,)], ids=["no dead time", "dead time"])
def test_a_part_of_the_drive_scales_the_field(others):
    with_effect = play(define("drive", "g*drive", ["drive"], g=0.2), *others)
    assert_close(with_effect.truth.field, 1.2 * play(*others).truth.field, 5e-5)


@pytest.mark.parametrize("stiffness", [1e12, 1e6])
def test_a_force_of_the_acceleration_in_the_mounting_is_a_moving_mass(stiffness):
    mass = {"name": "moving_mass", "parameters": {"mass": 4.0}}
    own = play(define("mounting", "m*acceleration", ["acceleration"], m=4.0), stiffness=stiffness)
    without, library = play(stiffness=stiffness), play(mass, stiffness=stiffness)
    assert_close(own.force - without.force, library.force - without.force, 1e-3)


@pytest.mark.parametrize("form", ["linear", "in series"])
def test_an_elongation_over_the_force_is_a_compliance_of_the_fixture(plain, form):
    library = {"name": "fixture_compliance", "form": "linear", "parameters": {"compliance": 2e-6}}
    part = {**library, "parameters": {"compliance": 0.5e-6}}
    own = define("mounting", "c*force", ["force"], c=2e-6 if form == "linear" else 1.5e-6)
    run, expected = play(own, *([part] if form == "in series" else [])), play(library)
    assert_close(run.force - plain.force, expected.force - plain.force, 0.05)


def test_a_soft_middle_of_the_mounting_is_crossed_before_the_damper_moves_on(plain):
    run = play(define("mounting", "a*tanh(force/s)", ["force"], a=1e-4, s=5.0))
    lag = run.truth.position[::SUBSTEPS] - run.truth.damper_displacement
    pulled = run.truth.force[::SUBSTEPS] > 50.0
    assert lag[pulled] == pytest.approx(1e-4, rel=0.05)


def test_a_force_in_the_mounting_does_not_heat_the_damper(plain):
    run, change = play_with(plain, "mounting", "a*velocity", ["velocity"], a=500.0)
    assert_close(change, 500.0 * run.truth.velocity, 1e-3)
    assert np.allclose(run.truth.temperature, plain.truth.temperature, atol=1e-9)


def test_a_function_of_the_force_channel_adds_to_the_recorded_force_only(plain):
    run, change = play_with(
        plain, "force_channel", "a*sin(w*time) + g*force", ["time", "force"], a=3.0, w=300.0, g=0.1
    )
    assert_close(change, 3.0 * np.sin(300.0 * FINE) + 0.1 * plain.force, 1e-9)
    assert np.array_equal(run.truth.force, plain.truth.force)


def test_the_force_channel_acts_after_the_additive_effects_of_the_library():
    crosstalk = {"name": "coil_crosstalk", "parameters": {"gain": 5.0}}
    library = play(crosstalk).force
    change = play(define("force_channel", "g*force", ["force"], g=0.5), crosstalk).force - library
    assert_close(change, 0.5 * library, 1e-9)


def test_a_function_of_the_displacement_channel_adds_to_the_recorded_displacement(plain):
    run, _ = play_with(
        plain, "displacement_channel", "g*displacement + d*velocity", ["displacement", "velocity"], g=0.02, d=1e-3
    )
    expected = 0.02 * plain.truth.position + 1e-3 * np.gradient(plain.truth.position, STEP / SUBSTEPS)
    assert_close((run.displacement - plain.truth.position)[1:-1], expected[1:-1], 2e-7)
    assert np.array_equal(run.truth.position, plain.truth.position)


def test_a_curve_acts_alone_and_is_constant_beyond_its_ends(plain):
    x, values = [-0.006, -0.001, 0.004], [-12.0, 5.0, 8.0]
    curve = {"variable": "displacement", "unit": "N", "x": x, "value": values}
    run, change = play_with(plain, "parallel_force", None, ["displacement"], curve)
    assert_close(change, np.interp(run.truth.position, x, values), 1e-3)


# Variables.


def trace_steady(x):
    """Return the displacement after its deadband."""
    steady = np.empty(len(x))
    held = x[0]
    for i, value in enumerate(x):
        held = steady[i] = np.clip(held, value - 1e-6, value + 1e-6)
    return steady


def test_travel_since_reversal_starts_anew_at_every_reversal(plain):
    run, change = play_with(plain, "parallel_force", "k*travel_since_reversal", ["travel_since_reversal"], k=1e4)
    steady = trace_steady(run.truth.position)
    turns = np.flatnonzero(np.diff(np.sign(np.diff(steady)[np.diff(steady) != 0.0])))
    assert len(turns) >= 5
    moving = np.flatnonzero(np.diff(steady) != 0.0)
    last = np.full(len(steady), steady[0])
    for turn in turns:
        last[moving[turn + 1] + 1 :] = steady[moving[turn + 1]]
    assert_close(change, 1e4 * np.abs(steady - last), 1e-3)


def test_travel_since_rest_adds_both_directions_and_starts_anew_after_a_rest_only():
    ramps = np.interp(TIME, [0, 0.1, 0.3, 0.45, 0.6, 0.7, 1.4, 1.6], [0, 0, 4e-3, 4e-3, 1e-3, 1e-3, 1e-3, 3e-3])
    still = play(command=ramps)
    effect = define("parallel_force", "k*travel_since_rest", ["travel_since_rest"], k=1e4)
    travel = (play(effect, command=ramps).force - still.force)[::SUBSTEPS] / 1e4
    assert travel[50] == 0.0
    # The deadband takes a micrometre at the start and two at each reversal.
    assert travel[440] == pytest.approx(4e-3, abs=5e-6)  # a rest of 0.15 s is none
    assert travel[800] == pytest.approx(7e-3, abs=1e-5)
    assert abs(travel[1390]) < 1e-12
    assert travel[1750] == pytest.approx(2e-3, abs=5e-6)
    assert abs(travel[1990]) < 1e-12


def test_drive_history_is_the_drive_at_its_last_reversal():
    steps = np.array([0.1, 0.3, 0.5, 0.2, 0.2, 0.4, 0.3, 0.1])[(TIME / 0.25).astype(int)]
    history = np.array([0.1, 0.1, 0.1, 0.5, 0.5, 0.2, 0.4, 0.4])[(TIME / 0.25).astype(int)]
    own = play(define("drive", "g*drive_history", ["drive", "drive_history"], g=0.5), drive=steps)
    change = own.truth.field - play(drive=steps).truth.field
    assert_close(change, play(drive=0.5 * history).truth.field, 5e-5)


def test_the_history_of_the_field_is_the_field_at_its_last_reversal():
    drive = np.array([0.1, 0.5, 0.5, 0.3])[(TIME / 0.5).astype(int)]
    own = play(define("field", "g*drive_history", ["drive", "drive_history"], g=0.5), drive=drive)
    without = play(drive=drive)
    for at, history in ((slice(800, 1490), 0.1), (slice(1600, 1990), 0.5)):
        shifted = play(drive=drive, **offset_field(0.5 * history))
        change, expected = ((run.force - without.force)[::SUBSTEPS][at] for run in (own, shifted))
        assert_close(change, expected, 0.01 * np.abs(expected).max())


@pytest.mark.parametrize("others", [(), (HEATING,)], ids=["no loss", "loss"])
def test_dissipated_energy_is_the_work_on_the_damper_without_loss(others):
    effect = define("parallel_force", "a*dissipated_energy", ["dissipated_energy"], a=2.0)
    run, without = play(effect, *others), play(*others)
    power = np.abs(run.truth.force * run.truth.velocity)
    energy = np.concatenate([[0.0], np.cumsum(0.5 * (power[1:] + power[:-1]))]) * STEP / SUBSTEPS
    assert_close(run.force - without.force, 2.0 * energy, 2e-3 * 2.0 * energy[-1])


def test_time_starts_with_the_run(plain):
    _, change = play_with(plain, "parallel_force", "a*time", ["time"], a=7.0)
    assert_close(change, 7.0 * FINE, 1e-6)


def test_acceleration_is_that_of_the_actuator(plain):
    run, change = play_with(plain, "parallel_force", "m*acceleration", ["acceleration"], m=5.0)
    assert_close(change[2:-2], 5.0 * np.gradient(run.truth.velocity, STEP / SUBSTEPS)[2:-2], 5e-2)


def test_the_displacement_is_that_of_the_damper_behind_its_fixture():
    fixture = {"name": "fixture_compliance", "form": "linear", "parameters": {"compliance": 2e-7}}
    own = play(define("parallel_force", "k*displacement", ["displacement"], k=5e4), fixture)
    k1 = LAW.k1 + 5e4
    law = {"damper": LAW._replace(k1=k1, x0=LAW.k1 * LAW.x0 / k1)._asdict()}
    without = play(fixture).force
    assert_close(own.force - without, play(fixture, **law).force - without, 1e-2)


# Plant.


def test_advancing_sample_by_sample_gives_the_motion_of_a_whole_record():
    effect = define("damper_gain", "a*travel_since_rest + b*time", ["travel_since_rest", "time"], a=5.0, b=0.05)
    whole = play(effect).truth.force[: 300 * SUBSTEPS]
    plant = Plant(make_scenario(effect), COMMAND[0], DRIVE[0])
    parts = [plant.advance(STEP, COMMAND[i + 1], DRIVE[i]).force for i in range(300)]
    assert np.array_equal(np.concatenate(parts), whole)


def test_channel_functions_of_the_time_continue_from_chunk_to_chunk(plain):
    scenario = make_scenario(define("force_channel", "a*time", ["time"], a=3.0))
    values = compute_true_values(scenario, plain.truth, 5.0, STEP)
    assert np.allclose(values["force"] - plain.truth.force, 3.0 * (5.0 + FINE))


@pytest.mark.parametrize("further", [(), (COIL_LAG,)], ids=["alone", "with a dead time"])
def test_a_step_response_of_the_drive_is_the_lag_of_the_library(further):
    late = define("drive", "1-exp(-time/s)", ["drive_history"], kind="step_response", s=0.02)
    lag = {"name": "coil_lag", "form": "second_lag", "parameters": {"lag": 0.02}}
    if further:
        lag = {"name": "coil_lag", "form": "dead_time_and_lag", "parameters": {"delay": 4e-3, "lag": 0.02}}
    expected = play(lag).force
    assert np.abs(play(*further, late).force - expected).max() < 0.01 * np.abs(play().force - expected).max()


def test_a_step_response_of_the_drive_acts_on_what_other_effects_add_to_it(plain):
    late = define("drive", "1-exp(-time/s)", ["drive_history"], kind="step_response", s=0.02)
    added = define("drive", "a*drive", ["drive"], a=0.2)
    late["name"] = late["definition"]["name"] = "of_yours"
    stronger = play({"name": "coil_lag", "form": "second_lag", "parameters": {"lag": 0.02}}, drive=1.2 * DRIVE)
    assert np.abs(play(added, late).force - stronger.force).max() < 0.01 * np.ptp(plain.force)


def test_a_step_response_of_the_drive_continues_from_sample_to_sample():
    late = define("drive", "1-a*exp(-time/s)", ["drive_history"], kind="step_response", a=0.6, s=0.02)
    whole = play(late).truth.force
    plant = Plant(make_scenario(late), COMMAND[0], DRIVE[0])
    parts = [plant.advance(STEP, COMMAND[i + 1], DRIVE[i]).force for i in range(700)]
    assert np.array_equal(np.concatenate(parts), whole[: 700 * SUBSTEPS])


def test_a_step_response_of_the_force_channel_is_the_filter_of_the_library():
    late = define("force_channel", "1-exp(-time/s)", ["force"], kind="step_response", s=0.01)
    filtered = {"name": "force_filter", "form": "first_order", "parameters": {"lag": 0.01}}

    def record(*effects):
        scenario, truth = make_scenario(*effects), play(*effects).truth
        return make_readings(scenario, TIME, truth)[0]["force"]

    expected = record(filtered)
    assert np.abs(record(late) - expected).max() < 2e-3 * expected.std()
    assert np.abs(record() - expected).max() > 0.1 * expected.std()


@pytest.mark.parametrize("place", ["parallel_force", "mounting"])
def test_the_plant_starts_settled_under_a_defined_force(place):
    scenario = make_scenario(define(place, "a + k*displacement", ["displacement"], a=300.0, k=1e3), stiffness=1e6)
    truth = Plant(scenario, 0.005, 0.2).simulate(STEP, np.full(101, 0.005), np.full(100, 0.2))
    assert np.ptp(truth.force) < 1e-5
    assert truth.position[0] - 0.005 == pytest.approx(-truth.force[0] / 1e6, rel=1e-6)


def test_forces_of_one_place_add_up(plain):
    first = define("parallel_force", "a", ["velocity"], a=11.0)
    second = define("parallel_force", "a*time", ["time"], a=7.0)
    second["name"] = second["definition"]["name"] = "of_yours"
    assert_close(play(first, second).force - plain.force, 11.0 + 7.0 * FINE, 1e-6)


def test_gains_of_one_place_multiply():
    gains = [define("damper_gain", "g", ["velocity"], g=g) for g in (0.1, 0.2, 0.32)]
    gains[1]["name"] = gains[1]["definition"]["name"] = "of_yours"
    assert_close(play(gains[0], gains[1]).force, play(gains[2]).force, 1e-6)
