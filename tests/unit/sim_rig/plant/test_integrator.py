import numpy as np
import pytest
from scipy.integrate import solve_ivp

from identification.damper.coordinates import Coordinates, to_parameters
from sim_rig.errors import PlantError
from sim_rig.plant.derivatives import compute_rates
from sim_rig.plant.jit import identity, no_force, rigid_mounting, unit_scale
from sim_rig.plant.plant import Plant
from sim_rig.plant.states import STATE_COUNT
from tests.support.damper_box import LABORATORY_BOX


def reference_force(plant: Plant, dt: float, command, drive):
    """Return the force at the samples by a variable-order solver of tight tolerance, restarted at each sample."""
    k, law, states, forces = plant._constants, plant._law, plant._states.copy(), []
    effects = (k, law, rigid_mounting, no_force, identity, unit_scale)
    for i in range(len(drive)):

        def rate(t, s, i=i):
            out = np.empty(STATE_COUNT)
            now = command[i] + (command[i + 1] - command[i]) * t / dt
            compute_rates(s, 0.0, 0.0, now, drive[i], 0.0, *effects, out)
            return out

        out = np.empty(STATE_COUNT)
        forces.append(compute_rates(states, 0.0, 0.0, command[i], drive[i], 0.0, *effects, out)[0])
        states = solve_ivp(rate, (0.0, dt), states, "LSODA", rtol=1e-10, atol=1e-13).y[:, -1]
    return np.array(forces)


@pytest.mark.parametrize("name", ["ideal", "lord_class"])
def test_force_agrees_with_a_tight_scipy_solution(varied, name):
    time = np.arange(401) * 1e-3
    command, drive = 0.01 * np.sin(8 * np.pi * time), np.where(time[:-1] < 0.2, 0.1, 0.5)
    reference = reference_force(Plant(varied(name), 0.0, 0.1), 1e-3, command, drive)
    force = Plant(varied(name), 0.0, 0.1).simulate(1e-3, command, drive).force[::8]
    assert np.abs(force - reference).max() < 1e-6 * np.abs(reference).max()


def draw_coordinates(random: np.random.Generator) -> Coordinates:
    """Draw a damper anywhere in the search box, half of its coordinates on a bound, with positive c0 and c1."""
    spread = {}
    for q in LABORATORY_BOX:
        inside = (
            np.exp(random.uniform(np.log(q.low), np.log(q.high))) if q.low > 0 else random.uniform(q.low, q.high)
        )
        spread[q.symbol] = float(random.choice([q.low, q.high]) if random.random() < 0.5 else inside)
    return Coordinates(**{**spread, "c0_b": 0.0, "c1_b": 0.0, "k0": abs(spread["k0"])})


@pytest.mark.parametrize("seed", range(8))
def test_any_damper_within_bounds_stays_finite_and_saturates(varied, seed):
    damper = to_parameters(draw_coordinates(np.random.default_rng(seed)))
    time = np.arange(41) * 1e-3
    plant = Plant(varied(damper=damper._asdict()), 0.0, 0.3)
    truth = plant.simulate(1e-3, 0.005 * np.sin(2 * np.pi * 15 * time), np.where(time[:-1] < 0.02, 0.3, 0.5))
    saturated = (damper.A / (damper.beta + damper.gamma)) ** (1 / damper.n)
    assert np.isfinite(truth.force).all()
    assert np.abs(truth.z).max() < 1.05 * saturated


def test_displacement_and_velocity_are_smooth_between_command_samples(varied):
    time = np.arange(301) * 1e-3
    truth = Plant(varied()).simulate(1e-3, 0.01 * np.sin(8 * np.pi * time), np.full(300, 0.3))
    acceleration = np.diff(truth.position, 2) * 8000.0**2
    assert np.abs(np.diff(acceleration)).max() < 0.05 * np.abs(acceleration).max()


def test_a_damper_that_generates_energy_is_refused_with_the_time_of_divergence(varied):
    law = varied().parameters
    damper = law._replace(alpha_a=law.alpha_a / 100, k0=-1e5, c0_a=1.0, c0_b=0.0, c1_a=100.0, c1_b=0.0)
    time = np.arange(2001) * 1e-3
    plant = Plant(varied(damper=damper._asdict()))
    with pytest.raises(PlantError, match=r"runs away .* s into its motion"):
        plant.simulate(1e-3, 0.01 * np.sin(8 * np.pi * time), np.zeros(2000))
