"""A rod that leaves its stroke for some hundredths of a second: nothing of it may reach the rest."""

from dataclasses import replace

import numpy as np
import pytest
from made_up_strokes import RATE, recorded, sine, sine_segment, stretch

from identification.assemble import assemble
from identification.motion import estimate_motion
from identification.recordings import Recording
from identification.smoother import derivative

AMPLITUDE, FREQUENCY = 8e-3, 1.0
AT = (2310, 2900, 5420)
"""Samples at which setpoints stay away."""
FAR = np.hanning(160) * 400e-6
"""[m] by which the rod is behind until the servo has caught up."""


def stumbling(at=AT, far=FAR, noise=2e-6):
    displacement, _ = sine(AMPLITUDE, FREQUENCY)
    for start in at:
        displacement[start : start + len(far)] -= far
    segment = sine_segment(0, len(displacement), AMPLITUDE, FREQUENCY)
    return displacement, stretch(recorded(displacement, noise), segments=[segment])


def around(at, width, count):
    near = np.zeros(count, bool)
    for start in at:
        near[start - width : start + len(FAR) + width] = True
    return near


def velocity_error(motion, displacement):
    return motion.velocity - derivative(displacement, RATE)


def test_the_rest_of_the_stroke_is_as_smooth_as_without():
    displacement, made = stumbling()
    motion = estimate_motion(made)
    _, sound = stumbling(at=())
    usual = estimate_motion(sound)
    rest = ~around(AT, 60, len(displacement))
    rest[:100] = rest[-100:] = False
    error = velocity_error(motion, displacement)[rest]
    assert np.sqrt(np.mean(error**2)) < 50e-6, "0.1 N at 2000 N s/m"
    assert np.median(motion.cutoff) == pytest.approx(np.median(usual.cutoff), rel=0.5)
    assert "with harmonics 1," in motion.method[0]


def test_in_a_stumble_the_rod_is_followed():
    displacement, made = stumbling()
    motion = estimate_motion(made)
    near = around(AT, 0, len(displacement))
    assert np.max(np.abs(motion.displacement - displacement)[near]) < 10e-6
    assert motion.cutoff[near].min() > 2.0 * np.median(motion.cutoff)


def test_far_off_its_samples_are_lost_and_nowhere_else():
    displacement, made = stumbling()
    lost = estimate_motion(made).lost
    middles = [start + len(FAR) // 2 for start in AT]
    assert lost[middles].all()
    assert not lost[~around(AT, 40, len(displacement))].any()


def test_a_small_stumble_is_smoothed_by_itself_but_not_lost():
    _, made = stumbling(far=FAR / 25)
    motion = estimate_motion(made)
    assert not motion.lost.any()
    assert motion.cutoff[AT[0] + len(FAR) // 2] > np.median(motion.cutoff)


def test_what_begins_where_the_drive_steps_is_the_actuators_answer():
    displacement, made = stumbling(at=(4000,), far=0.3 * FAR)
    stepped = replace(made, drive=np.where(np.arange(len(displacement)) < 4000, 0.1, 0.4))
    assert estimate_motion(made).lost.any()
    assert not estimate_motion(stepped).lost.any()


def test_no_actuator_answers_a_drive_by_half_a_millimetre():
    displacement, made = stumbling(at=(4000,))
    stepped = replace(made, drive=np.where(np.arange(len(displacement)) < 4000, 0.1, 0.4))
    assert estimate_motion(stepped).lost.any()


def test_what_is_lost_is_neither_fitted_nor_scored_and_that_is_said(tmp_path):
    _, made = stumbling()
    log = Recording(tmp_path / "run.mcap", "0" * 64, "coil_v", "V", (made,), {"run": {"source": "run"}})
    assembled = assemble([log])
    lost = estimate_motion(made).lost
    assert not assembled.pieces[0].train[lost].any()
    assert not assembled.stretches[0].counts[lost].any()
    assert assembled.notes == (
        f"{made.name}: the rod left its stroke (late setpoints, or a knock) in {lost.mean():.2%} of the samples; "
        "they are left out",
    )


def test_where_most_is_lost_all_is_kept_and_the_recording_called_bad(tmp_path, monkeypatch):
    _, made = stumbling()
    monkeypatch.setattr("identification.assemble._MOST_LOST", 0.01)
    log = Recording(tmp_path / "run.mcap", "0" * 64, "coil_v", "V", (made,), {"run": {"source": "run"}})
    assembled = assemble([log])
    assert assembled.stretches[0].counts.all()
    assert "record again" in assembled.notes[0]
