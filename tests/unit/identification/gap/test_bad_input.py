"""Recordings that cannot be diagnosed: an answer in words before anything is fitted."""

from dataclasses import replace

import numpy as np
import pytest
from made_up_runs import NOISE, RATE, run

from identification.errors import NothingToFit
from identification.gap.diagnose import diagnose

WHOLE = run()
COUNT = len(WHOLE.stretches[0].force)


def changed(**channels):
    """The run with some of its channels replaced."""
    return replace(WHOLE, stretches=(replace(WHOLE.stretches[0], **channels),))


def beginning(seconds):
    """The first seconds of the run."""
    count, stretch = round(seconds * RATE), WHOLE.stretches[0]
    channels = {
        name: getattr(stretch, name)[:count] for name in ("time", "displacement", "force", "drive", "measured")
    }
    kept = tuple(replace(s, stop=min(s.stop, count)) for s in stretch.segments if s.start < count)
    return changed(**channels, segments=kept)


def broken(value):
    force = WHOLE.stretches[0].force.copy()
    force[1000:1010] = value
    return changed(force=force)


FORCE = WHOLE.stretches[0].force
CASES = {
    "one cycle": (beginning(1.0), "holds 1 cycle of the stroke, and a diagnosis needs 4"),
    "no numbers": (broken(np.nan), "10 of 12000 samples of force are no numbers"),
    "infinite": (broken(np.inf), "10 of 12000 samples of force are no numbers"),
    "standing still": (changed(displacement=np.zeros(COUNT)), "stands still"),
    "one force": (changed(force=np.full(COUNT, 3.0)), "the force hardly changes"),
    "noise": (changed(force=NOISE * np.random.default_rng(1).standard_normal(COUNT)), "the force hardly changes"),
    "other sign": (changed(force=-FORCE), "has the other sign"),
    "small range": (changed(force=np.clip(FORCE, -50.0, 50.0)), "stands at its largest value, 50 N"),
    "slow alone": (
        changed(force_valid=np.abs(np.gradient(WHOLE.stretches[0].displacement)) * RATE < 0.02),
        "no force was recorded that counts",
    ),
}


@pytest.mark.parametrize(("recording", "words"), CASES.values(), ids=CASES)
def test_it_is_refused_in_words(recording, words):
    with pytest.raises(NothingToFit) as refused:
        diagnose([recording])
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


def test_without_repeats_the_floor_is_that_of_high_frequencies_and_it_is_said():
    found = diagnose([changed(segments=())]).diagnosis
    assert found.verdict == "no_gap"
    assert any("high frequencies alone" in note for note in found.notes)
