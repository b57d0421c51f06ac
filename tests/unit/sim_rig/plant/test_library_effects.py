"""Agreement of simulated rig and identification on the force of every form, each with its own integrator."""

import json

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter

from identification.damper.effects import EFFECTS
from identification.simulate import Excitation, SimulationModel, simulate
from sim_rig.plant.plant import Plant, count_substeps
from sim_rig.scenario.scenario import load_scenario, parse_scenario
from sim_rig.sensors.channels import compute_true_values
from tests.support.effects import FORMS, IDS, LABORATORY, MEDIUM, active

STEP = 1e-3
TIME = np.arange(3000) * STEP
PLAIN = (None, None)
TOLERANCE = {
    "coil_lag": 0.25,  # the rig interpolates the dead time between its substeps
    "clevis_backlash": 0.5,  # contacts begin and end within a sample
    "seal_friction": 0.1,  # a lip ignores a small part of its presliding distance
    "side_load_friction": 0.1,  # its guide does so, too
    "force_filter": 0.6,  # the force is taken as linear between samples
}
"""[N] rms tolerance of effects that need more than the usual one."""


def scenario(name, form):
    document = load_scenario("ideal").model_dump(mode="json", by_alias=True)
    document["actuator"] |= {"stiffness": 1e12}
    document["amplifier"] |= {"bandwidth": 1e5}
    if name is not None:
        symbols = [q.symbol for q in EFFECTS[name].find_form(form).parameters]
        values = dict(zip(symbols, MEDIUM[name][form], strict=True))
        document["effects"] = [{"name": name, "form": form, "parameters": values}]
    return parse_scenario(json.dumps(document), "of a test")


def commands():
    ramp = np.clip(TIME / 0.5, 0, 1)
    command = 0.012 * np.sin(3 * np.pi * TIME) * ramp**3 * (10 - 15 * ramp + 6 * ramp**2)
    return np.append(command, command[-1]), np.array([0.1, 0.4, 0.0, 0.5, 0.2])[(TIME / 0.63).astype(int) % 5]


def simulate_both(name, form):
    """Return the true force of the rig's channel, and that which identification simulates for its motion."""
    rig, (command, drive) = scenario(name, form), commands()
    truth = Plant(rig, command[0], drive[0]).simulate(STEP, command, drive)
    true_values, substeps = compute_true_values(rig, truth, 0.0, STEP), count_substeps(STEP)
    fine = np.arange(len(truth.force)) * STEP / substeps
    values = MEDIUM[name][form] if name else ()
    delay = values[0] if name in ("force_delay", "displacement_delay") else 0.0
    force, at = true_values["force"], TIME
    if name == "force_filter":
        decay = np.exp(-STEP / substeps / values[0])
        force = lfilter([1 - decay], [1, -decay], force, zi=[force[0] * decay])[0]
    if name == "displacement_delay":
        at = np.maximum(TIME - delay, 0.0)
    force = np.interp(TIME - delay, fine, force) if name == "force_delay" else force[::substeps]
    motion = CubicSpline(fine, true_values["displacement"])
    power = np.abs(truth.force[::substeps] * truth.damper_velocity)
    stroke = Excitation(1 / STEP, motion(at), motion(at, 1), motion(at, 2), truth.output, power=power)
    effects = (active(name, form),) if name else ()
    stroke = stroke.oversample(4) if name == "clevis_backlash" else stroke
    simulated = simulate(SimulationModel(LABORATORY, y0=truth.y[0], effects=effects), stroke).force
    return force, simulated[:: 4 if name == "clevis_backlash" else 1]


@pytest.fixture(scope="module")
def plain():
    return simulate_both(*PLAIN)[0]


@pytest.mark.parametrize(("name", "form"), [PLAIN, *FORMS], ids=["plain", *IDS])
def test_rig_and_identification_agree(name, form):
    force, simulated = simulate_both(name, form)
    error = (simulated - force)[60:-10]
    assert np.sqrt(np.mean(error**2)) < TOLERANCE.get(name, 0.03)


@pytest.mark.parametrize(("name", "form"), FORMS, ids=IDS)
def test_every_effect_changes_the_channels_of_the_rig(name, form, plain):
    rig, (command, drive) = scenario(name, form), commands()
    if EFFECTS[name].find_form(form).action in ("time_shift", "force_lag", "displacement_shift"):
        return
    truth = Plant(rig, command[0], drive[0]).simulate(STEP, command, drive)
    true_values, without = (
        compute_true_values(rig, truth, 0.0, STEP),
        compute_true_values(scenario(*PLAIN), truth, 0.0, STEP),
    )
    substeps = count_substeps(STEP)
    displacement_change = np.abs(true_values["displacement"] - without["displacement"]).max()
    force_change = np.abs(true_values["force"][::substeps] - plain).max()
    assert displacement_change > 1e-5 or force_change > 1.0
