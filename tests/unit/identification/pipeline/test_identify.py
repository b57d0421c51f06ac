"""Identification of simulated recordings: held-out samples, delays, filters, intervals, documents."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import signal

from identification.commands.identify import report_fit
from identification.documents.fit import Fit
from identification.errors import UnusableDataError
from identification.fitting.dataset import HoldOut, assemble
from identification.fitting.force_channel import LowPass, compute_filter_delay
from identification.fitting.output_error import fit_output_error
from identification.fitting.piece import Piece
from identification.fitting.problem import Problem
from identification.fitting.search_space import SearchSpace
from identification.logs import ChannelFilter
from identification.pipeline import FitRequest, identify
from identification.predict.predict import predict_log
from identification.signals.motion import estimate_recorded_noise
from identification.simulate import Excitation
from identification.uncertainty.input_noise import remove_bias, replace_motion, resample_input_noise
from tests.support import candidate_pools
from tests.support.fit_problems import SCALES
from tests.support.laboratory import FAST, LABORATORY, NOISE, RATE, SLOW, recording, stretch

FILTER = ChannelFilter("butterworth", 2, 300.0)


def test_the_fit_converges_and_reaches_the_noise_floor(fit):
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


def test_drive_steps_between_two_samples_leave_the_noise():
    # With the drive as recorded the error is 1.28 times the noise.
    fit = identify([candidate_pools.record(advances=(0.9, 0.1, 0.9, 0.0, 0.8))])
    assert fit.rmse_n.train == pytest.approx(candidate_pools.NOISE, rel=0.03)


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


def test_prediction_of_a_validation_stroke_reaches_the_noise_floor(fit):
    validation = recording(stretch("validation", 0.012, 1.5, 3), sha256="1" * 64)
    prediction, series = predict_log(fit, validation)
    assert prediction.rmse_n == pytest.approx(NOISE, rel=0.05)
    assert prediction.freed == ["y0 of each stretch"]
    assert prediction.provenance.settings["log_seen_by_fit"] is False
    assert series.held_out.all()
    assert np.std(series.simulated - series.force) == pytest.approx(prediction.rmse_n, rel=0.01)


def test_prediction_on_the_fitted_log_marks_the_held_out_samples(fit):
    prediction, series = predict_log(fit, recording(SLOW, FAST))
    assert prediction.provenance.settings["log_seen_by_fit"] is True
    assert series.held_out.sum() == 2000


def test_a_reported_filter_of_the_force_does_not_bias_the_fit():
    slow_filter = ChannelFilter("butterworth", 2, 80.0)
    rounded = [replace(s, force=LowPass(slow_filter, RATE).apply(s.force)) for s in (SLOW, FAST)]
    reported = [replace(s, force_filter=slow_filter) for s in rounded]

    def error_of_yield_displacement(stretches):
        found = identify([recording(*stretches)], FitRequest(delay_prior=1e-9))
        return abs(found.coordinates["D_y"].value / LABORATORY.D_y - 1)

    assert error_of_yield_displacement(reported) < 0.1 < error_of_yield_displacement(rounded)


def test_a_delay_beyond_the_clocks_is_reported_in_the_result():
    late = [replace(s, force=np.roll(s.force, 4)) for s in (SLOW, FAST)]
    found = identify([recording(*late)])
    assert found.nuisances.force_delay.outside_prior
    assert found.nuisances.force_delay.value > 1e-3
    assert "ms behind the displacement" in found.result


def test_a_clock_without_an_error_bound_widens_no_delay():
    mapped = {name: f'{{"skew_s": 6e-5, "channels": ["{name}"]}}' for name in ("force", "displacement")}
    log = recording(SLOW)
    said = replace(log, metadata={**log.metadata, "clocks": {**mapped, "thermometer": "stamped on receipt"}})
    assert assemble([said]).delay_prior == pytest.approx(np.hypot(6e-5, 6e-5) / 2)


def test_a_misfit_beyond_the_noise_is_reported_in_the_result():
    bent = [replace(s, force=s.force + 80.0 * np.sign(s.displacement)) for s in (SLOW, FAST)]
    assert "times the noise floor" in identify([recording(*bent)]).result


def test_lost_samples_are_neither_fitted_nor_scored(fit):
    measured = np.ones(len(SLOW.time), bool)
    measured[3000:3003] = False
    force = np.where(measured, SLOW.force, 5000.0)
    found = identify(
        [recording(replace(SLOW, measured=measured, force=force), FAST)], FitRequest(HoldOut(("fast_0.5V",)))
    )
    assert found.rmse_n.train == pytest.approx(fit.rmse_n.train, rel=0.01)


@pytest.mark.parametrize(
    ("recordings", "hold_out", "why"),
    [
        ([recording(SLOW)], HoldOut(("nothing*",)), "matches no stretch and no segment"),
        ([recording(SLOW)], HoldOut(("slow",)), "fewer than 200"),
        ([recording(SLOW), recording(FAST, drive_kind="coil_a")], HoldOut(), "driven in different ways"),
    ],
)
def test_what_cannot_be_fitted_is_refused_with_the_reason(recordings, hold_out, why):
    with pytest.raises(UnusableDataError, match=why):
        assemble(recordings, hold_out)


def test_hold_out_after_a_fraction_keeps_the_rest():
    held = HoldOut(after_fraction=0.6).make_mask(SLOW)
    assert not held[:4800].any()
    assert held[4800:].all()


def test_the_lag_of_a_filter_is_that_of_slow_signals():
    frequency, (_, response) = 1.0, signal.freqs(*signal.butter(2, 2 * np.pi * 300.0, analog=True), [2 * np.pi])
    assert compute_filter_delay(FILTER) == pytest.approx(
        -np.angle(response[0]) / (2 * np.pi * frequency), rel=1e-4
    )
    assert compute_filter_delay(None) == 0.0


def test_a_filter_on_a_finer_grid_keeps_a_steady_force_and_rounds_a_step():
    low_pass = LowPass(FILTER, RATE, oversampling=4)
    steady = low_pass.apply(np.full(41, 7.0))
    np.testing.assert_allclose(steady, np.full(11, 7.0), rtol=1e-12)
    step = low_pass.apply(np.where(np.arange(41) < 20, 0.0, 1.0))
    assert 0 < step[6] < 1 < step[8] < 1.05


def test_displacement_noise_adds_to_the_uncertainty():
    assembled = assemble([recording(FAST)])
    problem = Problem(assembled.pieces, SearchSpace(0.0, 0.5, SCALES), NOISE, 20e-6)
    minimum = fit_output_error(problem)
    quiet = replace(FAST, displacement=np.array(assembled.pieces[0].excitation.displacement))
    noisy = resample_input_noise(problem, [FAST], minimum, 1).scatter
    assert np.all(np.linalg.eigvalsh(noisy) > -1e-9)
    assert noisy[2, 2] > 4 * resample_input_noise(problem, [quiet], minimum, 1).scatter[2, 2]


def test_the_bias_of_input_noise_is_that_of_many_fits_to_noisy_motions():
    """Pairs of fits with opposite noise: their common part is the bias."""
    loud = replace(
        FAST, displacement=FAST.displacement + 8e-6 * np.random.default_rng(5).standard_normal(len(FAST.time))
    )
    problem = Problem(assemble([recording(loud)]).pieces, SearchSpace(0.0, 0.5, SCALES), NOISE, 20e-6)
    minimum = fit_output_error(problem)
    input_noise = resample_input_noise(problem, [loud], minimum, 1)
    force, motion = problem.simulate(minimum.unknowns)[0], problem.pieces[0].excitation.displacement
    ends = []
    for seed in range(8):
        noise = estimate_recorded_noise(loud) * np.random.default_rng(seed).standard_normal(len(motion))
        for sign in (-1.0, 1.0):
            again = replace(loud, displacement=motion + sign * noise, force=force)
            piece = replace_motion(replace(problem.pieces[0], force=force), again)
            ends.append(fit_output_error(replace(problem, pieces=(piece,)), start=minimum.unknowns).unknowns[2])
    assert input_noise.bias[2] > 0.1 * np.sqrt(input_noise.scatter[2, 2])
    assert np.mean(ends) - minimum.unknowns[2] == pytest.approx(input_noise.bias[2], rel=0.5)
    corrected = remove_bias(problem, minimum, input_noise.bias)
    assert corrected.unknowns[2] == pytest.approx(minimum.unknowns[2] - input_noise.bias[2], abs=1e-12)
    assert minimum.evaluation.cost < corrected.evaluation.cost < minimum.evaluation.cost + 2.0


def test_noise_of_the_measured_drive_adds_to_the_uncertainty_of_the_yield_force():
    random = np.random.default_rng(3)
    quiet = replace(FAST, displacement=np.array(assemble([recording(FAST)]).pieces[0].excitation.displacement))
    noisy = replace(quiet, drive=FAST.drive + 3e-3 * random.standard_normal(len(FAST.drive)))
    scatter = []
    for noised in (quiet, noisy):
        problem = Problem(assemble([recording(noised)]).pieces, SearchSpace(0.0, 0.5, SCALES), NOISE, 20e-6)
        scatter.append(resample_input_noise(problem, [noised], fit_output_error(problem), 1).scatter)
    assert scatter[1][0, 0] > 1.5 * scatter[0][0, 0]


def test_the_fast_variant_drops_filter_and_backlash_oversampling():
    piece = Piece("p", Excitation(RATE, *(np.zeros(3),) * 4), np.zeros(3), np.ones(3))
    assert piece.make_fast().low_pass is None
    assert piece.make_fast().backlash_oversampling == 1
    assert piece.make_fast().excitation is piece.excitation


def late_by(seconds):
    return [replace(s, force=np.interp(s.time - seconds, s.time, s.force)) for s in (SLOW, FAST)]


def test_a_delay_prior_that_the_user_states_bounds_the_delay():
    free = identify([recording(*late_by(1e-3))], FitRequest(stages=("refine",)))
    bound = identify([recording(*late_by(1e-3))], FitRequest(stages=("refine",), delay_prior=1e-4))
    assert free.nuisances.force_delay.value > 4e-4
    assert bound.nuisances.force_delay.value == pytest.approx(3e-4, rel=1e-6)
    assert bound.nuisances.force_delay.outside_prior
    assert "0.3 ms behind the displacement" in bound.result


def test_each_note_of_a_fit_is_printed_on_its_own_line(fit, capsys):
    many = fit.model_copy(update={"notes": [f"samples {i} to {i + 9} are left out" for i in range(25)]})
    report_fit(Path("fit.json"), many)
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 10
    assert lines[1] == "  note: samples 0 to 9 are left out"
    assert lines[-1] == "  and 17 more notes: see `notes` in the document"
