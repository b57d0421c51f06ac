from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from made_up_strokes import stretch
from numpy.random import default_rng

from identification.errors import NothingToFit
from identification.gap.checks import (
    blind_spots,
    enough_cycles,
    one_specimen,
    sliding_recorded,
    without_clipping,
)
from identification.gap.floor import Floor
from identification.gap.residual import Condition, Cycles
from identification.recordings import Recording

FLOOR = Floor(2.0, 2.0, 2.0, "cycle to cycle")


def recording(force, specimen="LAB-001"):
    made = stretch(np.zeros(len(force)), force)
    return Recording(Path("run.mcap"), "0" * 64, "coil_v", "V", (made,), {"run": {"specimen": specimen}})


def cycles(count, *conditions):
    return Cycles(np.zeros(10, int), np.zeros(10), np.zeros(count, int), conditions)


def loop():
    return 300.0 * np.sin(np.arange(4000) / 100.0) + 2.0 * default_rng(0).standard_normal(4000)


def test_different_specimens_are_refused_by_name():
    with pytest.raises(NothingToFit, match="LAB-001, LAB-002"):
        one_specimen([recording(loop()), recording(loop(), "LAB-002")])


def test_a_force_that_is_not_clipped_stays():
    given = recording(np.round(loop(), 2))
    cleaned, notes = without_clipping([given])
    assert notes == []
    assert cleaned[0].stretches[0].counts.all()


def test_clipped_samples_are_left_out_and_it_is_said():
    cleaned, notes = without_clipping([recording(np.clip(loop(), -295.0, 295.0))])
    left = cleaned[0].stretches[0]
    assert 0.02 < np.mean(~left.counts) < 0.2
    assert left.measured.all(), "the displacement is as good as ever"
    assert "clipped at 295 N" in notes[0]


def test_a_force_that_is_mostly_clipped_is_refused_with_the_limit():
    with pytest.raises(NothingToFit, match="100 N"):
        without_clipping([recording(np.clip(loop(), -100.0, 100.0))])


def test_a_knock_that_was_left_out_is_no_speed_that_the_stroke_lacks():
    velocity = 0.1 * np.sin(np.arange(4000) / 100.0)
    train = np.ones(4000)
    velocity[2000:2010], train[1990:2020] = 0.4, 0.0
    made = SimpleNamespace(stroke=SimpleNamespace(velocity=velocity), train=train)
    sliding_recorded([made])
    made.train = np.where(np.abs(velocity) > 0.04, 0.0, 1.0)
    with pytest.raises(NothingToFit, match=r"above 0\.05 m/s no force"):
        sliding_recorded([made])


def test_one_cycle_is_refused_in_words():
    with pytest.raises(NothingToFit, match="holds 1 cycle of"):
        enough_cycles(cycles(1))
    enough_cycles(cycles(4))


def test_what_poor_strokes_cannot_show_is_said():
    poor = cycles(6, Condition(0.0, 0.01, 1.0))
    notes = " ".join(blind_spots(poor, FLOOR))
    assert "one drive" in notes
    assert "one frequency" in notes
    assert "one amplitude" in notes
    rich = cycles(6, Condition(0.0, 0.01, 1.0), Condition(0.2, 0.005, 3.0))
    notes = " ".join(blind_spots(rich, FLOOR))
    assert "one " not in notes
    assert "calibration" in notes


def test_no_repeats_are_said():
    notes = blind_spots(cycles(6, Condition(0.0, 0.01, 0.0)), replace(FLOOR, cycle_to_cycle=None, how="no cycles"))
    assert any("high frequencies alone" in note for note in notes)
