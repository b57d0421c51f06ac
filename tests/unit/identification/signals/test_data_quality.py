"""Invalid recordings are refused with the reason; invalid samples are excluded with a note."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identification.errors import UnreadableLogError, UnusableDataError
from identification.logs.recording import Recording, load
from identification.pipeline import identify
from identification.signals.data_quality import check_single_specimen, clean_recordings, mask_invalid_samples
from identification.simulate import Excitation, SimulationModel, simulate
from tests.support.laboratory import FAST, LABORATORY, NOISE, SLOW, recording, stretch
from tests.support.mcap_logs import times, writing
from tests.support.strokes import stretch as make_stretch

RANDOM = np.random.default_rng(5)
SPIKED = RANDOM.choice(np.arange(50, 7950), 20, replace=False)


def changed(**channels):
    return replace(SLOW, **channels)


def with_values(values, samples, value):
    replaced = values.copy()
    replaced[samples] = value
    return replaced


def decimated(given, factor):
    segments = tuple(replace(g, start=g.start // factor, stop=g.stop // factor) for g in given.segments)
    arrays = {n: getattr(given, n)[::factor] for n in ("time", "displacement", "force", "drive", "measured")}
    return replace(given, rate=given.rate / factor, segments=segments, **arrays)


def sine_force(limit=np.inf, specimen="LAB-001"):
    """A recording of a sinusoidal force of 300 N, clipped at a limit [N]."""
    force = 300.0 * np.sin(np.arange(4000) / 100.0) + 2.0 * np.random.default_rng(0).standard_normal(4000)
    clipped = np.clip(np.round(force, 2), -limit, limit)
    at_rest = make_stretch(np.zeros(len(force)), clipped)
    return Recording(Path("run.mcap"), "0" * 64, "coil_v", "V", (at_rest,), {"run": {"specimen": specimen}})


def refusal(*stretches):
    with pytest.raises(UnusableDataError) as caught:
        clean_recordings([recording(*stretches)])
    return str(caught.value)


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        (changed(displacement=np.full(8000, 1e-3)), "stands still"),
        (changed(displacement=1e-6 * RANDOM.standard_normal(8000)), "stands still"),
        (changed(force=np.zeros(8000)), "the force hardly changes"),
        (changed(force=NOISE * RANDOM.standard_normal(8000)), "the force hardly changes"),
        (changed(force=-SLOW.force), "the wrong sign"),
        (changed(displacement=np.full(8000, np.nan)), "8000 of 8000 samples of displacement are not finite"),
        (changed(force=np.clip(SLOW.force, -200, 200)), "of the force samples are clipped at 200 N (limit 20%)"),
        (decimated(stretch("slow", 0.01, 1.0, 1, seconds=400.0), 333), "3 samples a cycle"),
    ],
)
def test_a_recording_that_cannot_determine_a_damper_is_refused_with_the_reason(given, reason):
    assert reason in refusal(given)


def test_a_strong_mains_line_near_half_the_sampling_rate_is_no_noise_of_the_force():
    slow = decimated(stretch("slow", 0.01, 1.0, 1, seconds=60.0), 5)
    line = 0.3 * slow.force.std() * np.cos(0.98 * np.pi * np.arange(len(slow.force)))
    assert len(clean_recordings([recording(replace(slow, force=slow.force + line))])[0]) == 1


def test_logs_of_different_specimens_are_refused():
    other = replace(recording(FAST), metadata={"run": {"specimen": "another"}})
    with pytest.raises(UnusableDataError, match="different specimens"):
        identify([recording(SLOW), other])


@pytest.mark.parametrize("size", [1e4, 1e30])
def test_spikes_in_the_force_do_not_move_the_fit(size):
    spiky = changed(force=with_values(SLOW.force, SPIKED, size))
    fit = identify([recording(spiky, FAST)])
    assert any("0.25% of the force samples are spikes" in note for note in fit.notes)
    assert fit.rmse_n.train == pytest.approx(NOISE, rel=0.03)
    assert fit.noise_floor_n == pytest.approx(NOISE, rel=0.05)


def test_spikes_in_the_displacement_do_not_move_the_fit():
    fit = identify([recording(changed(displacement=with_values(SLOW.displacement, SPIKED, 0.0)), FAST)])
    assert any("displacement samples are spikes" in note for note in fit.notes)
    assert fit.rmse_n.train == pytest.approx(NOISE, rel=0.05)


def test_a_dropout_of_the_load_cell_is_excluded():
    fit = identify([recording(changed(force=with_values(SLOW.force, slice(2000, 2300), 0.0)), FAST)])
    assert any("slow: 3.7" in note and "constant while the damper moves" in note for note in fit.notes)
    assert fit.rmse_n.train == pytest.approx(NOISE, rel=0.05)


def test_clipped_peaks_of_the_force_are_excluded_and_their_displacement_is_kept():
    limit = float(np.quantile(np.abs(SLOW.force), 0.93))
    cleaned, notes = clean_recordings([recording(changed(force=np.clip(SLOW.force, -limit, limit)), FAST)])
    given = cleaned[0].stretches[0]
    assert any("clipped" in note for note in notes)
    assert given.measured.all()
    assert 0.05 < np.mean(~given.valid_mask) < 0.09


def test_two_specimens_are_named():
    with pytest.raises(UnusableDataError, match="LAB-001, LAB-002"):
        check_single_specimen([sine_force(), sine_force(specimen="LAB-002")], "diagnose")


def test_a_force_without_clipping_is_not_masked():
    cleaned, notes = mask_invalid_samples([sine_force()])
    assert notes == []
    assert cleaned[0].stretches[0].valid_mask.all()


def test_clipped_samples_are_masked_with_a_note_and_their_displacement_is_kept():
    cleaned, notes = mask_invalid_samples([sine_force(295.0)])
    masked = cleaned[0].stretches[0]
    assert 0.02 < np.mean(~masked.valid_mask) < 0.2
    assert masked.measured.all()
    assert "clipped at 295 N" in notes[0]


def test_spikes_of_force_and_displacement_are_masked_for_a_diagnosis():
    given = changed(
        force=with_values(SLOW.force, SPIKED, SLOW.force[SPIKED] + 2e4),
        displacement=with_values(SLOW.displacement, SPIKED[:3], SLOW.displacement[SPIKED[:3]] + 5e-3),
    )
    cleaned, notes = mask_invalid_samples([recording(given, FAST)])
    masked = cleaned[0].stretches[0]
    np.testing.assert_array_equal(np.flatnonzero(~masked.valid_mask), np.sort(SPIKED))
    np.testing.assert_array_equal(np.flatnonzero(~masked.measured), np.sort(SPIKED[:3]))
    assert len(notes) == 2


def test_a_force_that_is_mostly_clipped_is_refused_with_its_limit():
    with pytest.raises(UnusableDataError, match="100 N"):
        mask_invalid_samples([sine_force(100.0)])


def test_a_coarse_converter_is_not_mistaken_for_a_defective_one():
    coarse = changed(force=np.round(SLOW.force / 20.0) * 20.0)
    assert clean_recordings([recording(coarse, FAST)])[1] == []


def test_valid_recordings_are_not_changed():
    cleaned, notes = clean_recordings([recording(SLOW, FAST)])
    assert cleaned[0].stretches == (SLOW, FAST)
    assert notes == []


def test_one_drive_and_one_stroke_are_noted():
    notes = clean_recordings([recording(stretch("only", 0.01, 1.0, 1, levels=(0.3,)))])[1]
    assert any("the drive never changes" in note for note in notes)
    assert any("all strokes are alike" in note for note in notes)


def test_another_damper_under_the_same_name_is_noted():
    stiffer = LABORATORY._replace(F_a=3 * LABORATORY.F_a, c0_a=2 * LABORATORY.c0_a)
    t = SLOW.time
    w = 2 * np.pi
    stroke = Excitation(
        1000.0, 0.01 * np.sin(w * t), 0.01 * w * np.cos(w * t), -0.01 * w * w * np.sin(w * t), SLOW.drive
    )
    force = simulate(SimulationModel(stiffer), stroke).force + NOISE * RANDOM.standard_normal(len(t))
    outlier = replace(recording(replace(SLOW, force=force)), path=SLOW_PATH.with_name("outlier.mcap"))
    others = [replace(recording(s), path=SLOW_PATH.with_name(f"{s.name}.mcap")) for s in (SLOW, FAST)]
    notes = identify([*others, outlier]).notes
    assert any(note.startswith("outlier.mcap") and "another damper" in note for note in notes)


SLOW_PATH = recording(SLOW).path


def test_a_few_samples_are_refused_or_determine_few_coordinates():
    few = replace(SLOW, segments=(), **{n: getattr(SLOW, n)[:300] for n in ("time", "drive", "measured")})
    random = replace(few, displacement=RANDOM.standard_normal(300), force=RANDOM.standard_normal(300))
    with pytest.raises(UnusableDataError):
        identify([recording(random)])
    short = replace(few, displacement=SLOW.displacement[:300], force=SLOW.force[:300])
    fit = identify([recording(short)])
    assert not fit.coordinates["eta"].identifiable
    assert not fit.coordinates["k1"].identifiable


def test_numerical_errors_are_explained(monkeypatch):
    def singular(*_):
        raise np.linalg.LinAlgError("Singular matrix")

    monkeypatch.setattr("identification.pipeline.fit_input.make_problem", singular)
    with pytest.raises(UnusableDataError, match="do not determine a damper"):
        identify([recording(SLOW)])


def test_a_channel_without_a_finite_value_is_named(tmp_path, monkeypatch):
    monkeypatch.setenv("MRBENCH_CACHE", str(tmp_path / "cache"))
    with writing(tmp_path / "run.mcap") as log:
        log.samples(times(300), force=[None] * 300)
    with pytest.raises(UnreadableLogError, match="channel 'force' contains only NaN"):
        load(tmp_path / "run.mcap")
