"""identify and predict on made-up recordings: hold-out, delays, filters, intervals, documents."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import signal

from identification.assemble import HoldOut, assemble
from identification.damper.coordinates import to_coordinates
from identification.damper.parameter_sets import parameter_set
from identification.errors import NothingToFit
from identification.force_channel import LowPass, filter_lag
from identification.identify import Request, identify
from identification.motion import recorded_noise
from identification.motion_noise import play_noise, with_motion, without_pull
from identification.piece import Piece
from identification.predict import predict_log
from identification.problem import Problem
from identification.recordings import ChannelFilter, Recording, Segment, Stretch
from identification.refine import refine
from identification.results import Fit
from identification.search_space import SearchSpace
from identification.simulate import Setting, Stroke, simulate

LABORATORY = to_coordinates(parameter_set("laboratory").parameters)
RATE, NOISE, MOTION_NOISE = 1000.0, 2.5, 2e-6
LEVELS = (0.0, 0.3, 0.1, 0.5)
FILTER = ChannelFilter("butterworth", 2, 300.0)


def stretch(name, amplitude, frequency, seed, seconds=8.0, levels=LEVELS, **changes) -> Stretch:
    """One sine stroke of the laboratory damper, two seconds a level, as a bench would record it."""
    t = np.arange(round(seconds * RATE)) / RATE
    w = 2 * np.pi * frequency
    x = amplitude * np.sin(w * t)
    drive = np.array(levels)[np.minimum((t * len(levels) / seconds).astype(int), len(levels) - 1)]
    stroke = Stroke(RATE, x, amplitude * w * np.cos(w * t), -w * w * x, drive)
    force = simulate(Setting(LABORATORY), stroke, fineness=0.005).force
    random = np.random.default_rng(seed)
    edges = np.linspace(0, len(t), len(levels) + 1).astype(int)
    segments = [
        Segment(i, f"{name}_{level}V", start, stop, "sine", amplitude, frequency, level)
        for i, (level, start, stop) in enumerate(zip(levels, edges[:-1], edges[1:], strict=True))
    ]
    made = Stretch(
        name=name, time=t, rate=RATE, displacement=x + MOTION_NOISE * random.standard_normal(len(t)),
        force=force + NOISE * random.standard_normal(len(t)), drive=drive, velocity=None, segments=tuple(segments),
        force_filter=None, displacement_filter=None, force_delay=0.0, displacement_delay=0.0, drive_delay=0.0,
        measured=np.ones(len(t), bool),
    )  # fmt: skip
    return replace(made, **changes)


def recording(*stretches, drive_kind="coil_v", source="run", sha256="0" * 64) -> Recording:
    metadata = {"run": {"specimen": "made up", "source": source}}
    return Recording(Path("made-up.mcap"), sha256, drive_kind, "V", tuple(stretches), metadata)


SLOW, FAST = stretch("slow", 0.010, 1.0, 1), stretch("fast", 0.005, 2.5, 2)


@pytest.fixture(scope="module")
def fit() -> Fit:
    return identify([recording(SLOW, FAST)], Request(HoldOut(("fast_0.5V",))))


def test_the_fit_reaches_the_floor_and_says_so(fit):
    assert fit.result == "converged"
    assert fit.noise_floor_n == pytest.approx(NOISE, rel=0.05)
    assert fit.rmse_n.train == pytest.approx(NOISE, rel=0.03)
    assert fit.rmse_n.held_out == pytest.approx(NOISE, rel=0.08)
    assert fit.nrmse.train < 0.02


def test_most_true_values_lie_inside_the_99_percent_intervals(fit):
    known = {name: e for name, e in fit.coordinates.items() if e.identifiable}
    inside = [e.ci99[0] <= getattr(LABORATORY, name) <= e.ci99[1] for name, e in known.items()]
    assert len(known) >= 12
    assert sum(inside) >= len(inside) - 1


def test_held_out_segments_are_named_by_the_fit_and_not_fitted(fit):
    assert fit.provenance.settings["hold_out"] == "fast_0.5V"
    assembled = assemble([recording(SLOW, FAST)], HoldOut(("fast_0.5V",)))
    assert assembled.held_out[1].sum() == 2000
    assert assembled.pieces[1].train[assembled.held_out[1]].sum() == 0
    assert not assembled.held_out[0].any()


def test_the_document_survives_a_round_trip(fit):
    assert Fit.model_validate_json(fit.model_dump_json(by_alias=True)) == fit


def test_errors_are_listed_by_drive(fit):
    assert [round(d.drive, 2) for d in fit.per_drive] == [0.0, 0.1, 0.3, 0.5]
    assert all(d.unit == "V" and d.rmse_n == pytest.approx(NOISE, rel=0.1) for d in fit.per_drive)
    assert sum(d.samples for d in fit.per_drive) == 16000


def test_prediction_of_an_unseen_stroke_reaches_the_floor(fit):
    unseen = recording(stretch("unseen", 0.012, 1.5, 3), sha256="1" * 64)
    prediction, series = predict_log(fit, unseen)
    assert prediction.rmse_n == pytest.approx(NOISE, rel=0.05)
    assert prediction.freed == ["y0 of each stretch"]
    assert prediction.provenance.settings["log_seen_by_fit"] is False
    assert series.held_out.all()
    assert np.std(series.simulated - series.force) == pytest.approx(prediction.rmse_n, rel=0.01)


def test_prediction_on_the_fitted_log_says_what_was_held_out(fit):
    prediction, series = predict_log(fit, recording(SLOW, FAST))
    assert prediction.provenance.settings["log_seen_by_fit"] is True
    assert series.held_out.sum() == 2000


def test_a_reported_filter_of_the_force_does_not_bias_the_fit():
    slow_filter = ChannelFilter("butterworth", 2, 80.0)
    rounded = [replace(s, force=LowPass(slow_filter, RATE).apply(s.force)) for s in (SLOW, FAST)]
    reported = [replace(s, force_filter=slow_filter) for s in rounded]

    def error_of_yield_displacement(stretches):
        found = identify([recording(*stretches)], Request(delay_prior=1e-9))
        return abs(found.coordinates["D_y"].value / LABORATORY.D_y - 1)

    assert error_of_yield_displacement(reported) < 0.1 < error_of_yield_displacement(rounded)


def test_a_delay_beyond_the_clocks_is_said_in_the_result():
    late = [replace(s, force=np.roll(s.force, 4)) for s in (SLOW, FAST)]
    found = identify([recording(*late)])
    assert found.nuisances.force_delay.outside_prior
    assert found.nuisances.force_delay.value > 1e-3
    assert "ms behind the displacement" in found.result


def test_a_clock_that_is_described_in_words_widens_no_delay():
    mapped = {name: f'{{"skew_s": 6e-5, "channels": ["{name}"]}}' for name in ("force", "displacement")}
    log = recording(SLOW)
    said = replace(log, metadata={**log.metadata, "clocks": {**mapped, "thermometer": "stamped on receipt"}})
    assert assemble([said]).delay_prior == pytest.approx(np.hypot(6e-5, 6e-5) / 2)


def test_a_law_that_cannot_follow_is_said_in_the_result():
    bent = [replace(s, force=s.force + 80.0 * np.sign(s.displacement)) for s in (SLOW, FAST)]
    assert "times the noise floor" in identify([recording(*bent)]).result


def test_lost_samples_are_neither_fitted_nor_scored(fit):
    measured = np.ones(len(SLOW.time), bool)
    measured[3000:3003] = False
    force = np.where(measured, SLOW.force, 5000.0)
    found = identify(
        [recording(replace(SLOW, measured=measured, force=force), FAST)], Request(HoldOut(("fast_0.5V",)))
    )
    assert found.rmse_n.train == pytest.approx(fit.rmse_n.train, rel=0.01)


@pytest.mark.parametrize(
    ("recordings", "hold_out", "why"),
    [
        ([recording(SLOW)], HoldOut(("nothing*",)), "names no stretch and no segment"),
        ([recording(SLOW)], HoldOut(("slow",)), "fewer than 200 samples"),
        ([recording(SLOW), recording(FAST, drive_kind="coil_a")], HoldOut(), "driven in different ways"),
    ],
)
def test_what_cannot_be_fitted_is_refused_with_the_reason(recordings, hold_out, why):
    with pytest.raises(NothingToFit, match=why):
        assemble(recordings, hold_out)


def test_hold_out_after_a_fraction_keeps_the_rest():
    held = HoldOut(after=0.6).mask(SLOW)
    assert not held[:4800].any()
    assert held[4800:].all()


def test_the_lag_of_a_filter_is_that_of_slow_signals():
    frequency, (_, response) = 1.0, signal.freqs(*signal.butter(2, 2 * np.pi * 300.0, analog=True), [2 * np.pi])
    assert filter_lag(FILTER) == pytest.approx(-np.angle(response[0]) / (2 * np.pi * frequency), rel=1e-4)
    assert filter_lag(None) == 0.0


def test_a_filter_on_a_finer_grid_keeps_a_steady_force_and_rounds_a_step():
    low_pass = LowPass(FILTER, RATE, finer=4)
    steady = low_pass.apply(np.full(41, 7.0))
    np.testing.assert_allclose(steady, np.full(11, 7.0), rtol=1e-12)
    step = low_pass.apply(np.where(np.arange(41) < 20, 0.0, 1.0))
    assert 0 < step[6] < 1 < step[8] < 1.05


def test_displacement_noise_adds_to_the_uncertainty():
    assembled = assemble([recording(FAST)])
    problem = Problem(assembled.pieces, SearchSpace(0.0, 0.5), NOISE, 20e-6)
    minimum = refine(problem)
    quiet = replace(FAST, displacement=np.array(assembled.pieces[0].stroke.displacement))
    noisy = play_noise(problem, [FAST], minimum, 1).scatter
    assert np.all(np.linalg.eigvalsh(noisy) > -1e-9)
    assert noisy[2, 2] > 4 * play_noise(problem, [quiet], minimum, 1).scatter[2, 2]


def test_a_wrong_motion_pulls_the_yield_displacement_as_far_as_the_replays_say():
    """Fits to noise and to the same noise turned round: what the two share is no scatter."""
    loud = replace(
        FAST, displacement=FAST.displacement + 8e-6 * np.random.default_rng(5).standard_normal(len(FAST.time))
    )
    problem = Problem(assemble([recording(loud)]).pieces, SearchSpace(0.0, 0.5), NOISE, 20e-6)
    minimum = refine(problem)
    played = play_noise(problem, [loud], minimum, 1)
    force, motion = problem.simulate(minimum.unknowns)[0], problem.pieces[0].stroke.displacement
    ends = []
    for seed in range(8):
        noise = recorded_noise(loud) * np.random.default_rng(seed).standard_normal(len(motion))
        for sign in (-1.0, 1.0):
            again = replace(loud, displacement=motion + sign * noise, force=force)
            piece = with_motion(replace(problem.pieces[0], force=force), again)
            ends.append(refine(replace(problem, pieces=(piece,)), start=minimum.unknowns).unknowns[2])
    assert played.pull[2] > 0.1 * np.sqrt(played.scatter[2, 2])
    assert np.mean(ends) - minimum.unknowns[2] == pytest.approx(played.pull[2], rel=0.5)
    corrected = without_pull(problem, minimum, played.pull)
    assert corrected.unknowns[2] == pytest.approx(minimum.unknowns[2] - played.pull[2], abs=1e-12)
    assert minimum.evaluation.cost < corrected.evaluation.cost < minimum.evaluation.cost + 2.0


def test_noise_of_the_measured_drive_adds_to_the_uncertainty_of_the_yield_force():
    random = np.random.default_rng(3)
    quiet = replace(FAST, displacement=np.array(assemble([recording(FAST)]).pieces[0].stroke.displacement))
    noisy = replace(quiet, drive=FAST.drive + 3e-3 * random.standard_normal(len(FAST.drive)))
    scatter = []
    for stretch in (quiet, noisy):
        problem = Problem(assemble([recording(stretch)]).pieces, SearchSpace(0.0, 0.5), NOISE, 20e-6)
        scatter.append(play_noise(problem, [stretch], refine(problem), 1).scatter)
    assert scatter[1][0, 0] > 1.5 * scatter[0][0, 0]


def test_a_piece_without_a_filter_is_quicker_by_its_play_alone():
    piece = Piece("p", Stroke(RATE, *(np.zeros(3),) * 4), np.zeros(3), np.ones(3))
    assert piece.quicker().low_pass is None
    assert piece.quicker().finer_for_play == 1
    assert piece.quicker().stroke is piece.stroke
