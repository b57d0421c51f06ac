"""Expected shrinkage on another run, with its interval."""

import numpy as np
import pytest
from numpy.random import default_rng

from identification.gap.data.shrinkage import (
    CycleErrors,
    HeldOutErrors,
    Replicates,
    estimate_shares,
    estimate_shrinkage,
    extend_to_other_strokes,
)

NOISE = 2.0


def make_errors(before, after, segments=5):
    """Cycles of 500 samples with these mean squares [N²] without and with effects."""
    counts, segment = np.full(len(before), 500.0), np.arange(len(before)) * segments // len(before)
    return CycleErrors(counts * before, counts * after, counts, segment, segment % 4 == 2)


def close_gap(gap, share, cycles=30):
    """Cycles whose effects leave a share of a gap [N²], both with some scatter."""
    random = default_rng(2)
    excess = gap * random.uniform(0.5, 1.5, cycles)
    return make_errors(NOISE**2 + excess, NOISE**2 + share * excess * random.uniform(0.7, 1.3, cycles))


def replicate(*runs, cycles=0.0, gap=9.0):
    """Mean squares [N²] from the input noise of other runs, over whole runs and over the cycles."""
    return Replicates(cycles, cycles, np.array(runs or (0.0,)), NOISE**2 + gap)


def test_the_interval_contains_the_shrinkage():
    shrinkage = estimate_shrinkage(close_gap(9.0, 0.02), NOISE, replicate(), strokes=5)
    assert shrinkage.value == pytest.approx(0.97, abs=0.015)
    low, high = shrinkage.ci95
    assert low < shrinkage.value < high
    assert high - low < 0.15


def test_the_shrinkage_follows_from_the_reported_errors():
    shrinkage = estimate_shrinkage(close_gap(9.0, 0.1), NOISE, replicate(0.4), strokes=5)
    closed = 1.0 - (shrinkage.after**2 - NOISE**2) / (shrinkage.before**2 - NOISE**2)
    assert shrinkage.value == pytest.approx(closed, abs=1e-9)


def test_few_strokes_and_input_noise_lower_the_shrinkage_and_widen_the_interval():
    rich = estimate_shrinkage(close_gap(9.0, 0.1), NOISE, replicate(), strokes=5)
    poor = estimate_shrinkage(close_gap(9.0, 0.1), NOISE, replicate(), strokes=1)
    noisy = estimate_shrinkage(close_gap(9.0, 0.1), NOISE, replicate(0.5, 1.3), strokes=5)
    assert poor.value < rich.value
    assert poor.ci95[0] < rich.ci95[0] - 0.1
    assert noisy.value == pytest.approx(rich.value - 0.1, abs=0.02)
    assert noisy.ci95[0] < rich.ci95[0] - 0.05


def test_of_many_strokes_the_mean_is_expected_of_others():
    alike = make_errors(np.full(30, NOISE**2 + 9.0), np.full(30, NOISE**2 + 0.9))
    assert estimate_shrinkage(alike, NOISE, replicate(), strokes=50).value == pytest.approx(0.9, abs=0.01)


def test_one_bad_held_out_stroke_counts_as_one_of_all():
    errors = close_gap(9.0, 0.02)
    bad = errors._replace(after=np.where(errors.held_out, errors.counts * NOISE**2 + 2700.0, errors.after))
    on_held_out = 1.0 - bad.compute_means()[1] / 9.0 + NOISE**2 / 9.0
    shrinkage = estimate_shrinkage(bad, NOISE, replicate(), strokes=5)
    assert shrinkage.value > on_held_out + 0.3
    assert shrinkage.ci95[0] < estimate_shrinkage(errors, NOISE, replicate(), strokes=5).ci95[0] - 0.3


def test_a_set_that_does_harm_on_held_out_cycles_has_no_benefit():
    errors = close_gap(9.0, 0.02)
    harm = errors._replace(after=np.where(errors.held_out, errors.before + 1000.0, errors.after))
    assert estimate_shrinkage(harm, NOISE, replicate(), strokes=5).expected_benefit < 0.0
    assert estimate_shrinkage(errors, NOISE, replicate(), strokes=5).expected_benefit > 0.9


def test_slow_noise_that_is_larger_on_the_held_out_cycles_by_chance_is_no_harm():
    gap = 0.1 * NOISE**2
    errors = close_gap(gap, 0.0)
    unlucky = errors._replace(
        before=errors.before + 2.0 * gap * errors.counts * errors.held_out,
        after=errors.after + 2.0 * gap * errors.counts * errors.held_out,
    )
    benefits = [
        estimate_shrinkage(unlucky, NOISE, replicate(gap=gap), 5, chance).expected_benefit
        for chance in (0.0, gap, 3.0 * gap)
    ]
    assert benefits == pytest.approx([-1.0, 0.0, 1.0], abs=0.05)


def test_input_noise_larger_than_the_gap_leaves_no_benefit():
    gap = 0.1 * NOISE**2
    errors = close_gap(gap, 0.2)
    assert estimate_shrinkage(errors, NOISE, replicate(1.2 * gap, gap=gap), strokes=1).expected_benefit < 0.0
    assert estimate_shrinkage(errors, NOISE, replicate(0.2 * gap, gap=gap), strokes=1).expected_benefit > 0.0


def test_input_noise_on_the_cycles_is_not_form_error():
    errors = close_gap(9.0, 0.1)
    without, with_noise = (
        estimate_shrinkage(errors, NOISE, replicate(0.5, cycles=cycles), strokes=5) for cycles in (0.0, 0.5)
    )
    assert with_noise.value > without.value + 0.03


def test_errors_below_the_floor_by_chance_close_no_more_than_the_gap():
    errors = close_gap(1.0, 0.0)
    lucky = errors._replace(after=0.98 * errors.after)
    shrinkage = estimate_shrinkage(lucky, NOISE, replicate(0.1, gap=1.0), strokes=5)
    assert shrinkage.value == pytest.approx(0.9, abs=0.03)
    assert shrinkage.after > NOISE


@pytest.mark.parametrize("strokes", [1, 5])
def test_an_error_that_grows_on_other_strokes_lowers_the_shrinkage(strokes):
    recorded = estimate_shrinkage(close_gap(9.0, 0.05), NOISE, replicate(0.2), strokes)
    same, grown = (extend_to_other_strokes(recorded, np.full(3, g), strokes) for g in (1.0, 4.0))
    assert same == recorded
    assert grown.value < recorded.value - 0.02
    assert grown.ci95[0] < recorded.ci95[0]
    assert grown.before == recorded.before
    closed = 1.0 - (grown.after**2 - NOISE**2) / (grown.before**2 - NOISE**2)
    assert grown.value == pytest.approx(closed, abs=1e-9)


def test_other_strokes_are_more_often_like_many_recorded_ones():
    recorded = estimate_shrinkage(close_gap(9.0, 0.05), NOISE, replicate(), strokes=5)
    few, many = (extend_to_other_strokes(recorded, np.full(3, 4.0), strokes).value for strokes in (1, 9))
    assert recorded.value > many > few
    # One of five other strokes is outside the ranges of nine.
    assert recorded.value - many == pytest.approx(0.2 * (recorded.value - few), abs=0.01)


def test_a_part_that_no_stroke_could_leave_does_not_exceed_the_gap():
    recorded = estimate_shrinkage(close_gap(9.0, 0.05), NOISE, replicate(), strokes=1)
    assert extend_to_other_strokes(recorded, np.full(3, 1e6), 1).value == pytest.approx(0.0, abs=0.01)


def test_without_effects_nothing_shrinks_on_other_strokes_either():
    errors = close_gap(9.0, 0.1)
    nothing = estimate_shrinkage(errors._replace(after=errors.before), NOISE, replicate(), strokes=1)
    assert extend_to_other_strokes(nothing, np.full(3, 4.0), 1) is nothing


def test_without_effects_nothing_shrinks():
    errors = close_gap(9.0, 0.1)
    same = errors._replace(after=errors.before)
    shrinkage = estimate_shrinkage(same, NOISE, replicate(), strokes=5)
    assert (shrinkage.value, shrinkage.ci95) == (0.0, (0.0, 0.0))


def test_at_the_floor_there_is_no_shrinkage():
    errors = make_errors(np.full(30, NOISE**2 * 1.02), np.full(30, NOISE**2))
    shrinkage = estimate_shrinkage(errors, NOISE, replicate(), strokes=5)
    assert shrinkage.value is None
    assert shrinkage.ci95 is None


def test_equal_errors_in_another_array_do_not_shrink_either():
    errors = close_gap(9.0, 0.1)
    shrinkage = estimate_shrinkage(errors._replace(after=errors.before.copy()), NOISE, replicate(), strokes=5)
    assert (shrinkage.value, shrinkage.ci95) == (0.0, (0.0, 0.0))


def test_one_stroke_is_less_certain_than_two_and_none_counts_as_one():
    none, one, two = (
        estimate_shrinkage(close_gap(9.0, 0.1), NOISE, replicate(), strokes=strokes) for strokes in (0, 1, 2)
    )
    assert none == one
    assert one.value < two.value - 0.01
    assert one.ci95[0] < two.ci95[0] - 0.05


def make_uniform(before, after, counts):
    """Cycles of one segment with the same mean squares [N²]; the last one is held out."""
    counts = np.array(counts, float)
    return CycleErrors(
        counts * before, counts * after, counts, np.zeros(len(counts), int), np.arange(len(counts)) > 0
    )


def test_without_form_error_the_input_noise_of_other_runs_alone_remains():
    errors = make_uniform(NOISE**2 + 9.0, NOISE**2, [10.0, 30.0, 20.0])
    shrinkage = estimate_shrinkage(errors, NOISE, replicate(0.9), strokes=5)
    # 0.9 / 9 over a gap with a logarithmic deviation of 0.35: mean factor exp(0.35^2 / 2) = 1.063.
    assert shrinkage.value == pytest.approx(1.0 - 0.1063, abs=0.005)
    # Quantiles at 1.96 x 0.35: factors 0.5036 and 1.986.
    assert shrinkage.ci95 == pytest.approx((1.0 - 0.1986, 1.0 - 0.0504), abs=0.012)
    assert shrinkage.expected_benefit == pytest.approx(0.9)
    assert shrinkage.before == pytest.approx(np.sqrt(13.0))
    assert shrinkage.after == pytest.approx(np.sqrt(4.0 + (1.0 - shrinkage.value) * 9.0))


def test_the_form_error_of_many_strokes_keeps_its_mean_and_scatters_in_log_odds():
    errors = make_uniform(NOISE**2 + 10.0, NOISE**2 + 1.5, [10.0, 30.0, 20.0])
    shrinkage = estimate_shrinkage(errors, NOISE, replicate(cycles=0.5, gap=10.0), strokes=10**9)
    # (1.5 - 0.5) / 10 remains; log odds -2.197 - 0.32 x 0.8 +- 1.96 x 0.8: 0.0176 and 0.292 remain.
    assert shrinkage.value == pytest.approx(0.9, abs=0.008)
    assert shrinkage.ci95 == pytest.approx((1.0 - 0.292, 1.0 - 0.0176), abs=0.03)
    assert shrinkage.expected_benefit == pytest.approx(1.0 - (1.5 - 0.5) / 10.0)


@pytest.mark.parametrize("remaining", [0.3, 0.6, 0.9])
@pytest.mark.parametrize("strokes", [1, 10**9])
def test_a_large_part_that_remains_is_never_more_than_the_gap(remaining, strokes):
    errors = make_uniform(NOISE**2 + 10.0, NOISE**2 + 10.0 * remaining, [10.0, 30.0, 20.0])
    shrinkage = estimate_shrinkage(errors, NOISE, replicate(gap=10.0), strokes)
    assert shrinkage.value == pytest.approx(1.0 - remaining, abs=0.05)
    assert 0.0 < shrinkage.ci95[0] < 1.0 - remaining < shrinkage.ci95[1]


def test_effects_that_harm_some_strokes_can_increase_the_gap():
    counts, segment = np.full(12, 500.0), np.repeat(np.arange(6), 2)
    before, after = NOISE**2 + np.full(12, 9.0), NOISE**2 + np.where(segment < 3, 1.0, 25.0)
    errors = CycleErrors(counts * before, counts * after, counts, segment, segment % 2 == 0)
    assert estimate_shrinkage(errors, NOISE, replicate(), strokes=6).ci95[0] < 0.0


@pytest.mark.parametrize(("ratio", "shrinks"), [(1.019, False), (1.021, True)])
def test_a_gap_within_two_per_cent_of_the_floor_has_no_shrinkage(ratio, shrinks):
    errors = make_uniform((ratio * NOISE) ** 2, NOISE**2, [10.0, 30.0])
    shrinkage = estimate_shrinkage(errors, NOISE, replicate(gap=1.0), strokes=5)
    assert (shrinkage.value is not None) == shrinks
    assert shrinkage.before == pytest.approx(ratio * NOISE)


def test_a_gap_that_is_smaller_than_the_noise_is_divided_by_a_hundredth_of_it():
    errors = make_uniform(NOISE**2 + 9.0, NOISE**2 + 1.0, [10.0, 30.0])
    shrinkage = estimate_shrinkage(errors, NOISE, replicate(0.02, gap=0.0), strokes=5)
    assert shrinkage.expected_benefit == pytest.approx(1.0 - 1.02 / 0.04)


def make_held_out(without, segments=6, cycles=8):
    """Held-out cycles with a gap of 9 N² and mean squares [N²] without each effect."""
    counts = np.full(segments * cycles, 100.0)
    segment = np.repeat(np.arange(segments), cycles)
    scatter = 1.0 + 0.1 * default_rng(3).standard_normal(len(counts))
    squares = {name: counts * scatter * square for name, square in without.items()}
    return HeldOutErrors(counts * scatter * 10.0, counts * scatter * 1.0, squares, counts, segment)


def test_a_share_is_the_part_of_the_gap_that_returns_without_the_effect():
    shares = estimate_shares(make_held_out({"a": 10.0, "b": 2.8}), 1.0, 1.0)
    for name, expected in (("a", 1.0), ("b", 0.2)):
        value, (low, high) = shares[name]
        assert value == pytest.approx(expected, abs=0.02)
        assert low <= value <= high
        assert high - low < 0.2


def test_a_share_counts_from_the_error_that_is_expected_of_another_run():
    # The measured error is the noise; 0.9 N² more are expected, a tenth of the gap.
    shares = estimate_shares(make_held_out({"a": 10.0}), np.sqrt(1.9), 1.0)
    assert shares["a"][0] == pytest.approx(0.9, abs=0.02)


def test_the_input_noise_of_another_run_is_no_part_of_one_effect_of_several():
    # 0.9 N² more are expected of another run, of the set without one of the effects as well.
    shares = estimate_shares(make_held_out({"a": 10.0, "b": 1.0}), np.sqrt(1.9), 1.0)
    assert shares["a"][0] == pytest.approx(1.0, abs=0.02)
    assert shares["b"][0] == pytest.approx(0.0, abs=1e-9)
