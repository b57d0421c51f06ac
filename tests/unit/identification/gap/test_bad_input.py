"""Recordings that cannot be diagnosed are refused before anything is fitted."""

from dataclasses import replace

import numpy as np
import pytest

from identification.errors import UnusableDataError
from identification.gap.diagnosis import diagnose
from tests.support.runs import NOISE, RATE, run

WHOLE = run()
COUNT = len(WHOLE.stretches[0].force)


def replace_channels(**channels):
    """The run with some of its channels replaced."""
    return replace(WHOLE, stretches=(replace(WHOLE.stretches[0], **channels),))


def cut(seconds):
    """The first seconds of the run."""
    count, stretch = round(seconds * RATE), WHOLE.stretches[0]
    channels = {
        name: getattr(stretch, name)[:count] for name in ("time", "displacement", "force", "drive", "measured")
    }
    segments = tuple(replace(s, stop=min(s.stop, count)) for s in stretch.segments if s.start < count)
    return replace_channels(**channels, segments=segments)


def replace_force(value):
    """The run with ten samples of the force replaced."""
    force = WHOLE.stretches[0].force.copy()
    force[1000:1010] = value
    return replace_channels(force=force)


FORCE = WHOLE.stretches[0].force
CASES = {
    "one cycle": (cut(1.0), "contains 1 cycle of the stroke; a diagnosis needs at least 4"),
    "not a number": (replace_force(np.nan), "10 of 12000 samples of force are not finite"),
    "infinite": (replace_force(np.inf), "10 of 12000 samples of force are not finite"),
    "standing still": (replace_channels(displacement=np.zeros(COUNT)), "stands still"),
    "one force": (replace_channels(force=np.full(COUNT, 3.0)), "the force hardly changes"),
    "noise": (
        replace_channels(force=NOISE * np.random.default_rng(1).standard_normal(COUNT)),
        "the force hardly changes",
    ),
    "other sign": (replace_channels(force=-FORCE), "has the wrong sign"),
    "small range": (replace_channels(force=np.clip(FORCE, -50.0, 50.0)), "are clipped at 50 N (limit 20%)"),
    "slow alone": (
        replace_channels(force_valid=np.abs(np.gradient(WHOLE.stretches[0].displacement)) * RATE < 0.02),
        "no valid force was recorded above",
    ),
}


@pytest.mark.parametrize(("recording", "message"), CASES.values(), ids=CASES)
def test_it_is_refused_with_the_reason_in_one_line(recording, message):
    with pytest.raises(UnusableDataError) as refused:
        diagnose([recording])
    assert message in str(refused.value)
    assert "\n" not in str(refused.value)


def test_without_cycles_the_floor_comes_from_high_frequencies_and_a_note_tells():
    diagnosis = diagnose([replace_channels(segments=())]).diagnosis
    assert diagnosis.verdict == "no_gap"
    assert any("high frequencies only" in note for note in diagnosis.notes)


def test_singular_equations_are_reported_as_unusable_data(monkeypatch):
    def fail(pool):
        raise np.linalg.LinAlgError("Singular matrix")

    monkeypatch.setattr("identification.gap.diagnosis.search_forward", fail)
    with pytest.raises(UnusableDataError, match="do not determine a damper"):
        diagnose([WHOLE])
