"""Field of one piece at any time."""

import numpy as np
import pytest

from identification.fitting import Piece
from identification.pinn.common.inputs import PieceInputs
from identification.simulate import Excitation, SimulationModel, simulate
from tests.support.pinn_problem import TRUTH, make_problem


def test_the_field_is_that_of_the_simulation_with_its_derivatives():
    piece = make_problem().pieces[0]
    inputs, time = PieceInputs(piece), np.array([1.4, 1.5004, 1.5101, 1.53, 3.002, 4.0])
    field = inputs.evaluate_field(time, TRUTH.eta, 0.0)
    assert field.u[2] == pytest.approx(0.3 * (1 - np.exp(-TRUTH.eta * 0.0101)), rel=1e-9)
    high, low = (inputs.evaluate_field(time, TRUTH.eta + d, 0.0).u for d in (1e-4, -1e-4))
    assert (high - low) / 2e-4 == pytest.approx(field.du_deta, rel=1e-5, abs=1e-10)
    later, earlier = (inputs.evaluate_field(time, TRUTH.eta, d).u for d in (1e-7, -1e-7))
    assert (later - earlier) / 2e-7 == pytest.approx(field.du_ddelay, rel=1e-4, abs=1e-6)
    assert np.isfinite(simulate(SimulationModel(TRUTH), piece.excitation).force).all()


def make_inputs(drive=(0.0, 0.0, 0.0, 1.0, 1.01, 1.0, 0.0, 0.0), rate=100.0):
    """A motion x = t^3 [m], sampled with its exact derivatives, and a drive."""
    time = np.arange(len(drive)) / rate
    excitation = Excitation(rate, time**3, 3 * time**2, 6 * time, np.array(drive))
    return PieceInputs(Piece("cubic", excitation, 0.0 * time, np.ones(len(time))))


def test_the_motion_is_interpolated_and_stays_at_its_ends():
    inputs = make_inputs()
    assert (inputs.h, inputs.duration) == pytest.approx((0.01, 0.07))
    x, v = inputs.evaluate_motion(np.array([0.034, -1.0, 1.0]))
    assert x == pytest.approx([0.034**3, 0.0, 0.07**3])
    assert v == pytest.approx([3 * 0.034**2, 0.0, 3 * 0.07**2])
    assert inputs.evaluate_acceleration(np.array([0.034])) == pytest.approx([6 * 0.034])
    assert inputs.rms_velocity == pytest.approx(3e-4 * np.sqrt(np.mean(np.arange(8.0) ** 4)))


def test_the_drive_is_held_between_samples_and_late():
    time = np.array([-1.0, 0.0349, 0.0351, 0.0449, 0.0451, 9.0])
    drive = make_inputs(drive=(0.1, 0.2, 0.3, 0.4, 0.5)).evaluate_drive(time, 0.005)
    assert drive.tolist() == [0.1, 0.3, 0.4, 0.4, 0.5, 0.5]


@pytest.mark.parametrize(
    ("min_distance", "steps"), [(0.0, [0.032, 0.062]), (0.029, [0.032, 0.062]), (0.031, [0.032])]
)
def test_drive_steps_are_the_large_changes_after_a_pause(min_distance, steps):
    # The change of 0.01 at the fifth sample is less than a fiftieth of the range.
    assert make_inputs().find_drive_steps(0.002, min_distance) == pytest.approx(steps)


@pytest.mark.parametrize(("change", "count"), [(0.019, 2), (0.022, 3)])
def test_a_step_is_a_change_by_a_fiftieth_of_the_range(change, count):
    drive = (0.0, 1.0, 1.0, 1.0 - change, 1.0 - change, 1.0 - change, 0.0, 0.0)
    assert len(make_inputs(drive).find_drive_steps(0.0, 0.0)) == count
    assert len(make_inputs((0.5,) * 8).find_drive_steps(0.0, 0.0)) == 0


def test_the_field_starts_settled_and_follows_a_step_with_its_rate():
    inputs = make_inputs(drive=(0.2, 0.2, 1.2, 1.2, 1.2, 1.2))
    field = inputs.evaluate_field(np.array([-1.0, 0.01, 0.034, 9.0]), 50.0, 0.004)
    decay = np.exp(-50.0 * 0.01)  # the drive steps at 20 ms + 4 ms
    assert field.u == pytest.approx([0.2, 0.2, 1.2 - decay, 1.2 - decay**3])  # it ends after 50 ms
    assert field.du_deta == pytest.approx([0.0, 0.0, 0.01 * decay, 0.03 * decay**3])
    assert field.du_ddelay == pytest.approx([0.0, 0.0, -50.0 * decay, -50.0 * decay**3])
