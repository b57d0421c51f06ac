"""Clock drift that the log allows is not a gap, and it does not hide an effect."""

from dataclasses import replace

import numpy as np
import orjson
import pytest

from identification.fitting.dataset import assemble
from identification.gap.diagnosis import diagnose, make_candidate_pool, prepare_recordings
from identification.gap.noise.clock_drift import describe_drift_explanation, subtract_clock_drift
from identification.gap.selection import SearchSettings
from tests.support.runs import NOISE, run, stiffening

CLOCK_ERROR = 2e-4
"""Clock error bound in the log [s]."""
SHORT_SEARCH = SearchSettings(no_gap_ratio=1.04, fit_budget=12)
"""By chance, the law alone lies 3 % above the floor on the held-out cycles of this short recording."""


def add_drift(recording, bound=CLOCK_ERROR, size=2.5):
    """The recording with a force early or late by some clock errors, and a log with this bound of its clocks."""
    (stretch,) = recording.stretches
    delay = size * CLOCK_ERROR * np.sin(2 * np.pi * stretch.time / 30.0)
    force = np.interp(stretch.time - delay, stretch.time, stretch.force)
    channels = {name: {"channels": [name], "skew_s": bound} for name in ("force", "displacement")}
    clocks = {name: orjson.dumps(entry).decode() for name, entry in channels.items()}
    metadata = {**recording.metadata, "clock_skew": clocks}
    return replace(recording, stretches=(replace(stretch, force=force),), metadata=metadata)


def test_the_clock_deviation_comes_from_the_log():
    assert assemble([add_drift(run())]).clock_deviation == pytest.approx(CLOCK_ERROR / np.sqrt(2))
    assert assemble([run()]).clock_deviation == 0.0


def subtract_drift(recording):
    """Excess [N²] of the law before and after the correction, and the drift [s]."""
    pool = make_candidate_pool(prepare_recordings([recording]))
    baseline = pool.fit_law()
    corrected, drift = subtract_clock_drift(baseline, pool.problems.full, pool.evaluation, CLOCK_ERROR)
    return baseline.train_rmse**2 - NOISE**2, corrected.train_rmse**2 - NOISE**2, drift


def test_the_residual_of_clock_drift_is_removed():
    before, after, drift = subtract_drift(add_drift(run(), size=0.8))
    assert after < 0.3 * before
    assert 0.5 * CLOCK_ERROR < drift < CLOCK_ERROR


def test_the_residual_of_an_effect_remains():
    before, after, _ = subtract_drift(run(stiffening))
    assert after > 0.95 * before


def test_drift_within_the_clock_deviation_is_no_gap_and_is_noted():
    diagnosis = diagnose([add_drift(run())], settings=SHORT_SEARCH).diagnosis
    assert diagnosis.verdict == "no_gap"
    assert any("drifts by" in note for note in diagnosis.notes)


def test_drift_without_a_clock_deviation_in_the_log_is_a_gap():
    diagnosis = diagnose([add_drift(run(), bound=0.0)], settings=SHORT_SEARCH).diagnosis
    assert diagnosis.verdict == "unexplained"
    assert not any("drifts by" in note for note in diagnosis.notes)


def test_an_effect_is_named_despite_drift():
    diagnosis = diagnose([add_drift(run(stiffening))], settings=SHORT_SEARCH).diagnosis
    assert [effect.name for effect in diagnosis.effects] == ["gas_spring"]
    assert not any("drifts by" in note for note in diagnosis.notes)


def test_the_note_states_the_drift_in_microseconds():
    assert "drifts by 23 µs within the run" in describe_drift_explanation(23.4e-6)
