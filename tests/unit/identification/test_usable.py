"""Bad input: an answer in words, never a traceback, never a silent number."""

from dataclasses import replace

import numpy as np
import pytest
from test_identify import FAST, LABORATORY, NOISE, SLOW, recording, stretch
from test_recordings import times, writing

from identification.errors import LogUnreadable, NothingToFit
from identification.identify import identify
from identification.recordings import load
from identification.simulate import Setting, Stroke, simulate
from identification.usable import usable

RANDOM = np.random.default_rng(5)
SOME = RANDOM.choice(np.arange(50, 7950), 20, replace=False)


def changed(**channels):
    return replace(SLOW, **channels)


def with_values(values, places, what):
    made = values.copy()
    made[places] = what
    return made


def thinned(made, every):
    segments = tuple(replace(g, start=g.start // every, stop=g.stop // every) for g in made.segments)
    arrays = {n: getattr(made, n)[::every] for n in ("time", "displacement", "force", "drive", "measured")}
    return replace(made, rate=made.rate / every, segments=segments, **arrays)


def refusal(*stretches):
    with pytest.raises(NothingToFit) as caught:
        usable([recording(*stretches)])
    return str(caught.value)


@pytest.mark.parametrize(
    ("made", "words"),
    [
        (changed(displacement=np.full(8000, 1e-3)), "stands still"),
        (changed(displacement=1e-6 * RANDOM.standard_normal(8000)), "stands still"),
        (changed(force=np.zeros(8000)), "the force hardly changes"),
        (changed(force=NOISE * RANDOM.standard_normal(8000)), "the force hardly changes"),
        (changed(force=-SLOW.force), "the other sign"),
        (changed(displacement=np.full(8000, np.nan)), "8000 of 8000 samples of displacement are no numbers"),
        (changed(force=np.clip(SLOW.force, -200, 200)), "of the force is clipped at 200 N"),
        (thinned(stretch("slow", 0.01, 1.0, 1, seconds=400.0), 333), "3 samples a cycle"),
    ],
)
def test_what_tells_nothing_of_a_damper_is_refused_in_words(made, words):
    assert words in refusal(made)


def test_logs_of_different_specimens_are_refused():
    other = replace(recording(FAST), metadata={"run": {"specimen": "another"}})
    with pytest.raises(NothingToFit, match="different specimens"):
        identify([recording(SLOW), other])


@pytest.mark.parametrize("size", [1e4, 1e30])
def test_spikes_in_the_force_do_not_move_the_fit(size):
    spiky = changed(force=with_values(SLOW.force, SOME, size))
    fit = identify([recording(spiky, FAST)])
    assert any("left out 0.25% of the samples, force is spikes" in note for note in fit.notes)
    assert fit.rmse_n.train == pytest.approx(NOISE, rel=0.03)
    assert fit.noise_floor_n == pytest.approx(NOISE, rel=0.05)


def test_spikes_in_the_displacement_do_not_move_the_fit():
    fit = identify([recording(changed(displacement=with_values(SLOW.displacement, SOME, 0.0)), FAST)])
    assert any("displacement is spikes" in note for note in fit.notes)
    assert fit.rmse_n.train == pytest.approx(NOISE, rel=0.05)


def test_a_load_cell_that_drops_out_is_left_out():
    fit = identify([recording(changed(force=with_values(SLOW.force, slice(2000, 2300), 0.0)), FAST)])
    assert any("left out 3.7" in note and "stands still" in note for note in fit.notes)
    assert fit.rmse_n.train == pytest.approx(NOISE, rel=0.05)


def test_a_force_clipped_at_its_peaks_is_left_out_there_and_its_displacement_kept():
    limit = float(np.quantile(np.abs(SLOW.force), 0.93))
    cleaned, notes = usable([recording(changed(force=np.clip(SLOW.force, -limit, limit)), FAST)])
    made = cleaned[0].stretches[0]
    assert any("clipped" in note for note in notes)
    assert made.measured.all()
    assert 0.05 < np.mean(~made.counts) < 0.09


def test_a_coarse_converter_is_not_taken_for_a_broken_one():
    coarse = changed(force=np.round(SLOW.force / 20.0) * 20.0)
    assert usable([recording(coarse, FAST)])[1] == []


def test_clean_recordings_pass_untouched():
    cleaned, notes = usable([recording(SLOW, FAST)])
    assert cleaned[0].stretches == (SLOW, FAST)
    assert notes == []


def test_one_drive_and_one_stroke_are_said():
    notes = usable([recording(stretch("only", 0.01, 1.0, 1, levels=(0.3,)))])[1]
    assert any("the drive never changes" in note for note in notes)
    assert any("all strokes are alike" in note for note in notes)


def test_another_damper_under_the_same_name_is_found_out():
    stiffer = LABORATORY._replace(F_a=3 * LABORATORY.F_a, c0_a=2 * LABORATORY.c0_a)
    t = SLOW.time
    w = 2 * np.pi
    stroke = Stroke(
        1000.0, 0.01 * np.sin(w * t), 0.01 * w * np.cos(w * t), -0.01 * w * w * np.sin(w * t), SLOW.drive
    )
    force = simulate(Setting(stiffer), stroke).force + NOISE * RANDOM.standard_normal(len(t))
    stranger = replace(recording(replace(SLOW, force=force)), path=SLOW_PATH.with_name("stranger.mcap"))
    others = [replace(recording(s), path=SLOW_PATH.with_name(f"{s.name}.mcap")) for s in (SLOW, FAST)]
    notes = identify([*others, stranger]).notes
    assert any(note.startswith("stranger.mcap") and "another damper" in note for note in notes)


SLOW_PATH = recording(SLOW).path


def test_a_few_samples_of_nonsense_end_in_words_or_in_honest_doubt():
    few = replace(SLOW, segments=(), **{n: getattr(SLOW, n)[:300] for n in ("time", "drive", "measured")})
    nonsense = replace(few, displacement=RANDOM.standard_normal(300), force=RANDOM.standard_normal(300))
    with pytest.raises(NothingToFit):
        identify([recording(nonsense)])
    short = replace(few, displacement=SLOW.displacement[:300], force=SLOW.force[:300])
    fit = identify([recording(short)])
    assert not fit.coordinates["eta"].identifiable
    assert not fit.coordinates["k1"].identifiable


def test_sums_that_break_down_are_said_in_words(monkeypatch):
    def singular(*_):
        raise np.linalg.LinAlgError("Singular matrix")

    monkeypatch.setattr("identification.identify.fit_problem", singular)
    with pytest.raises(NothingToFit, match="determine no damper"):
        identify([recording(SLOW)])


def test_a_channel_without_a_single_number_is_named(tmp_path, monkeypatch):
    monkeypatch.setenv("MRBENCH_CACHE", str(tmp_path / "cache"))
    with writing(tmp_path / "run.mcap") as log:
        log.samples(times(300), force=[None] * 300)
    with pytest.raises(LogUnreadable, match="channel 'force' holds no number"):
        load(tmp_path / "run.mcap")
