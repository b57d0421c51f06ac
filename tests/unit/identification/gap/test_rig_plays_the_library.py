"""The simulated rig and the identification agree on the force of every form, each with its own integrator."""

import json

import numpy as np
import pytest
from effect_examples import FORMS, IDS, LABORATORY, MEDIUM, active
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter

from identification.damper.effects import EFFECTS
from identification.simulate import Setting, Stroke, simulate
from sim_rig.plant import Plant, blocks_in
from sim_rig.scenario import load_scenario, parse_scenario
from sim_rig.sensors import looked_at

STEP = 1e-3
TIME = np.arange(3000) * STEP
PLAIN = (None, None)
TOLERANCE = {
    "coil_lag": 0.25,  # the rig rounds a dead time to the blocks in which it keeps its truth
    "clevis_backlash": 0.5,  # contacts begin and end within a sample
    "seal_friction": 0.3,  # a lip does not feel the last micrometre, so that noise does not move it
    "force_filter": 0.6,  # the force is taken to go straight from sample to sample
}
"""[N] rms, where more than the usual is expected."""


def scenario(name, form):
    document = load_scenario("ideal").model_dump(mode="json", by_alias=True)
    document["actuator"] |= {"stiffness": 1e12}
    document["amplifier"] |= {"bandwidth": 1e5}
    if name is not None:
        symbols = [q.symbol for q in EFFECTS[name].form(form).parameters]
        values = dict(zip(symbols, MEDIUM[name][form], strict=True))
        document["effects"] = [{"name": name, "form": form, "parameters": values}]
    return parse_scenario(json.dumps(document), "of a test")


def commands():
    ramp = np.clip(TIME / 0.5, 0, 1)
    command = 0.012 * np.sin(3 * np.pi * TIME) * ramp**3 * (10 - 15 * ramp + 6 * ramp**2)
    return np.append(command, command[-1]), np.array([0.1, 0.4, 0.0, 0.5, 0.2])[(TIME / 0.63).astype(int) % 5]


def both(name, form):
    """Force that the rig's channel looks at, and the simulated one on the displacement that its own looks at."""
    played, (command, drive) = scenario(name, form), commands()
    truth = Plant(played, command[0], drive[0]).play(STEP, command, drive)
    seen, blocks = looked_at(played, truth, 0.0, STEP), blocks_in(STEP)
    fine = np.arange(len(truth.force)) * STEP / blocks
    values = MEDIUM[name][form] if name else ()
    late = values[0] if name in ("force_delay", "displacement_delay") else 0.0
    force, at = seen["force"], TIME
    if name == "force_filter":
        kept = np.exp(-STEP / blocks / values[0])
        force = lfilter([1 - kept], [1, -kept], force, zi=[force[0] * kept])[0]
    if name == "displacement_delay":
        at = np.maximum(TIME - late, 0.0)
    force = np.interp(TIME - late, fine, force) if name == "force_delay" else force[::blocks]
    motion = CubicSpline(fine, seen["displacement"])
    power = np.abs(truth.force[::blocks] * truth.damper_velocity)
    stroke = Stroke(1 / STEP, motion(at), motion(at, 1), motion(at, 2), truth.output, power=power)
    effects = (active(name, form),) if name else ()
    stroke = stroke.finer(4) if name == "clevis_backlash" else stroke
    simulated = simulate(Setting(LABORATORY, y0=truth.y[0], effects=effects), stroke).force
    return force, simulated[:: 4 if name == "clevis_backlash" else 1]


@pytest.fixture(scope="module")
def plain():
    return both(*PLAIN)[0]


@pytest.mark.parametrize(("name", "form"), [PLAIN, *FORMS], ids=["plain", *IDS])
def test_rig_and_identification_agree(name, form):
    force, simulated = both(name, form)
    error = (simulated - force)[60:-10]
    assert np.sqrt(np.mean(error**2)) < TOLERANCE.get(name, 0.03)


@pytest.mark.parametrize(("name", "form"), FORMS, ids=IDS)
def test_the_effect_is_there_in_what_the_rig_records(name, form, plain):
    played, (command, drive) = scenario(name, form), commands()
    if EFFECTS[name].form(form).acts in ("time_shift", "force_lag", "displacement_shift"):
        return
    truth = Plant(played, command[0], drive[0]).play(STEP, command, drive)
    seen, without = looked_at(played, truth, 0.0, STEP), looked_at(scenario(*PLAIN), truth, 0.0, STEP)
    blocks = blocks_in(STEP)
    bent = np.abs(seen["displacement"] - without["displacement"]).max()
    changed = np.abs(seen["force"][::blocks] - plain).max()
    assert bent > 1e-5 or changed > 1.0
