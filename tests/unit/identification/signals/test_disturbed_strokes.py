"""Disturbances of some hundredths of a second, which must not affect the rest of the stroke."""

from dataclasses import replace

import numpy as np
import pytest

from identification.fitting.dataset import assemble
from identification.logs.recording import Recording
from identification.signals.motion import estimate_motion
from identification.signals.smoother import differentiate
from tests.support.strokes import RATE, recorded, sine, sine_segment, stretch

AMPLITUDE, FREQUENCY = 8e-3, 1.0
STARTS = (2310, 2900, 5420)
"""Samples at which setpoints are late."""
LAG = np.hanning(160) * 400e-6
"""Lag [m] of the rod until the servo has caught up."""


def make_disturbed(starts=STARTS, lag=LAG, noise=2e-6):
    displacement, _ = sine(AMPLITUDE, FREQUENCY)
    for start in starts:
        displacement[start : start + len(lag)] -= lag
    segment = sine_segment(0, len(displacement), AMPLITUDE, FREQUENCY)
    return displacement, stretch(recorded(displacement, noise), segments=[segment])


def mask_around(starts, width, count):
    near = np.zeros(count, bool)
    for start in starts:
        near[start - width : start + len(LAG) + width] = True
    return near


def velocity_error(motion, displacement):
    return motion.velocity - differentiate(displacement, RATE)


def test_the_rest_of_the_stroke_is_as_smooth_as_without():
    displacement, disturbed = make_disturbed()
    motion = estimate_motion(disturbed)
    _, undisturbed = make_disturbed(starts=())
    usual = estimate_motion(undisturbed)
    rest = ~mask_around(STARTS, 60, len(displacement))
    rest[:100] = rest[-100:] = False
    error = velocity_error(motion, displacement)[rest]
    assert np.sqrt(np.mean(error**2)) < 50e-6, "0.1 N at 2000 N s/m"
    assert np.median(motion.cutoff) == pytest.approx(np.median(usual.cutoff), rel=0.5)
    assert "with harmonics 1," in motion.description[0]


def test_the_rod_is_followed_in_a_disturbance():
    displacement, disturbed = make_disturbed()
    motion = estimate_motion(disturbed)
    near = mask_around(STARTS, 0, len(displacement))
    assert np.max(np.abs(motion.displacement - displacement)[near]) < 10e-6
    assert motion.cutoff[near].min() > 2.0 * np.median(motion.cutoff)


def test_only_samples_of_large_disturbances_are_unresolved():
    displacement, disturbed = make_disturbed()
    unresolved = estimate_motion(disturbed).unresolved
    middles = [start + len(LAG) // 2 for start in STARTS]
    assert unresolved[middles].all()
    assert not unresolved[~mask_around(STARTS, 40, len(displacement))].any()


def test_a_small_disturbance_is_smoothed_separately_and_resolved():
    _, disturbed = make_disturbed(lag=LAG / 25)
    motion = estimate_motion(disturbed)
    assert not motion.unresolved.any()
    assert motion.cutoff[STARTS[0] + len(LAG) // 2] > np.median(motion.cutoff)


def test_motion_that_begins_at_a_drive_step_is_the_response_of_the_actuator():
    displacement, disturbed = make_disturbed(starts=(4000,), lag=0.3 * LAG)
    stepped = replace(disturbed, drive=np.where(np.arange(len(displacement)) < 4000, 0.1, 0.4))
    assert estimate_motion(disturbed).unresolved.any()
    assert not estimate_motion(stepped).unresolved.any()


def test_half_a_millimetre_at_a_drive_step_is_a_disturbance():
    displacement, disturbed = make_disturbed(starts=(4000,))
    stepped = replace(disturbed, drive=np.where(np.arange(len(displacement)) < 4000, 0.1, 0.4))
    assert estimate_motion(stepped).unresolved.any()


def test_unresolved_samples_are_neither_fitted_nor_scored_with_a_note(tmp_path):
    _, disturbed = make_disturbed()
    log = Recording(tmp_path / "run.mcap", "0" * 64, "coil_v", "V", (disturbed,), {"run": {"source": "run"}})
    dataset = assemble([log])
    unresolved = estimate_motion(disturbed).unresolved
    assert not dataset.pieces[0].train[unresolved].any()
    assert not dataset.stretches[0].valid_mask[unresolved].any()
    assert dataset.notes == (
        f"{disturbed.name}: disturbances (late setpoints or shocks) in {unresolved.mean():.2%} of the samples; "
        "these samples were excluded",
    )


def test_a_mostly_disturbed_recording_is_kept_with_a_note(tmp_path):
    _, disturbed = make_disturbed()
    log = Recording(tmp_path / "run.mcap", "0" * 64, "coil_v", "V", (disturbed,), {"run": {"source": "run"}})
    dataset = assemble([log], max_excluded=0.01)
    assert dataset.stretches[0].valid_mask.all()
    assert "record again" in dataset.notes[0]
