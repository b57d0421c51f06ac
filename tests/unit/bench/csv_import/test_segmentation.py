import gzip
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from bench.csv_import.segmentation import find_segments, make_segment_names
from tests.support.logs import shared_folder

NOISE = 4e-6


def sine(amplitude, frequency, duration, rate=500.0):
    time = np.arange(round(duration * rate)) / rate
    return amplitude * np.sin(2 * np.pi * frequency * time)


def segment(displacement, drive, rate=500.0, noise=NOISE, seed=1, unit="V"):
    """Segments of a recording with noise, and their names."""
    displacement = displacement + np.random.default_rng(seed).normal(0, noise, len(displacement))
    drive = np.broadcast_to(np.asarray(drive, float), displacement.shape)
    segments = find_segments(np.arange(len(displacement)) / rate, displacement, drive, rate)
    assert segments[0].start == 0
    assert segments[-1].stop == len(displacement)
    assert all(left.stop == right.start for left, right in pairwise(segments))
    return segments, make_segment_names(segments, unit)


def staircase(levels, duration, rate=500.0):
    return np.repeat(np.asarray(levels, float), round(duration * rate))


SIX = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5)


def test_one_sine_at_one_drive_is_one_segment():
    segments, names = segment(sine(0.01, 1, 6), 0.2)

    assert names == ["10mm_1Hz_0.2V"]
    assert segments[0].amplitude == pytest.approx(0.01, rel=1e-3)
    assert segments[0].frequency == pytest.approx(1.0, rel=1e-3)
    assert segments[0].drive_value == pytest.approx(0.2)


def test_six_voltages_during_a_sine_are_six_segments_divided_at_the_steps():
    segments, names = segment(sine(0.01, 1, 12), staircase(SIX, 2))

    assert names == [f"10mm_1Hz_{level:g}V" for level in SIX]
    assert [segment.start for segment in segments] == [0, 1000, 2000, 3000, 4000, 5000]


def test_change_of_amplitude_and_frequency_is_found_to_the_sample():
    segments, names = segment(np.concatenate([sine(0.01, 1, 8), sine(0.008, 3, 8)]), 0.3)

    assert names == ["10mm_1Hz_0.3V", "8mm_3Hz_0.3V"]
    assert abs(segments[1].start - 4000) <= 2


def test_sines_that_meet_at_one_speed_are_divided_within_the_noise():
    segments, names = segment(np.concatenate([sine(0.01, 1, 8), sine(0.005, 2, 8)]), 0.3)

    assert names == ["10mm_1Hz_0.3V", "5mm_2Hz_0.3V"]
    assert abs(segments[1].start - 4000) <= 15


def test_motion_and_drive_that_change_together_give_one_boundary():
    motion = np.concatenate([sine(0.01, 1, 12), sine(0.005, 2, 12)])

    segments, names = segment(motion, np.tile(staircase(SIX, 2), 2))

    assert len(segments) == 12
    assert segments[6].start == 6000
    assert names[5:7] == ["10mm_1Hz_0.5V", "5mm_2Hz_0V"]


@pytest.mark.parametrize("seed", range(5))
def test_measured_drive_with_a_percent_of_noise_is_divided_like_the_clean_one(seed):
    levels = staircase(SIX, 2)
    generator = np.random.default_rng(seed)
    measured = levels * (1 + generator.normal(0, 0.01, len(levels))) + generator.normal(0, 0.002, len(levels))

    segments, names = segment(sine(0.01, 1, 12), measured, seed=seed)

    assert names == [f"10mm_1Hz_{level:g}V" for level in SIX]
    assert max(abs(segment.start - 1000 * i) for i, segment in enumerate(segments)) <= 5


def test_drive_that_settles_slowly_is_divided_once_per_step():
    levels = staircase((0.1, 0.5, 0.2), 4)
    settled = np.empty_like(levels)
    state = levels[0]
    for i, level in enumerate(levels):
        state += (level - state) * 0.02
        settled[i] = state

    assert segment(sine(0.01, 1, 12), settled)[1] == ["10mm_1Hz_0.1V", "10mm_1Hz_0.5V", "10mm_1Hz_0.2V"]


def test_spike_of_the_drive_gives_no_boundary():
    drive = np.full(3000, 0.2)
    drive[1500:1503] = 0.9

    assert segment(sine(0.01, 1, 6), drive)[1] == ["10mm_1Hz_0.2V"]


def test_drive_that_changes_many_times_a_cycle_is_not_divided_and_has_no_value():
    drive = np.tile(staircase((0.1, 0.4), 0.1), 30)

    segments, names = segment(sine(0.01, 1, 6), drive)

    assert names == ["10mm_1Hz"]
    assert segments[0].drive_value is None


def test_ramp_of_the_drive_is_not_divided():
    segments, _ = segment(sine(0.01, 1, 10), np.linspace(0, 0.5, 5000))

    assert [segment.drive_value for segment in segments] == [None]


def test_random_motion_under_a_drive_that_switches_at_random_is_one_segment():
    generator = np.random.default_rng(3)
    motion = np.convolve(generator.normal(0, 0.002, 10000), np.hanning(120) / 8, mode="same")
    drive = np.repeat(generator.choice([0.0, 2.25], 250), 40)

    segments, names = segment(motion, drive)

    assert names == ["random"]
    assert segments[0].drive_value is None
    assert segments[0].amplitude is None


def test_random_motion_at_one_drive_has_its_value():
    motion = np.convolve(np.random.default_rng(4).normal(0, 0.002, 10000), np.hanning(120) / 8, mode="same")

    assert segment(motion, 0.5)[1] == ["random_0.5V"]


def test_rest_is_a_hold_divided_where_the_drive_steps():
    assert segment(np.zeros(4000), staircase((0.0, 0.3), 4))[1] == ["hold_0V", "hold_0.3V"]


def test_soft_start_and_stop_are_separate_segments():
    time = np.arange(6000) / 500
    fade = np.clip(np.minimum(time - 1, 11 - time), 0, 1)
    segments, names = segment(0.01 * fade * np.sin(2 * np.pi * 2 * time), 0.75, unit="A")

    assert names == ["hold_0.75A", "other_0.75A", "10mm_2Hz_0.75A", "other_0.75A_2", "hold_0.75A_2"]
    assert segments[2].start == pytest.approx(1000, abs=40)
    assert segments[2].stop == pytest.approx(5000, abs=40)


@pytest.mark.parametrize("cycles", [3, 4])
def test_a_few_cycles_that_fade_in_and_out_are_a_sine_between_its_fades(cycles):
    motion = sine(0.01, 1, cycles)
    fade = np.minimum(np.minimum(np.arange(len(motion)), np.arange(len(motion))[::-1]) / 250, 1.0)

    segments, names = segment(motion * (0.5 - 0.5 * np.cos(np.pi * fade)), 0.2)

    assert [s.motion for s in segments] == ["other", "sine", "other"]
    assert segments[1].stop - segments[1].start >= 0.95 * (cycles - 1) * 500
    assert names[1] == "10mm_1Hz_0.2V"


def test_three_half_cycles_within_less_than_two_cycles_of_a_sine_are_no_sine():
    motion = np.concatenate([np.linspace(0, 0.01, 400), 0.01 * np.cos(2 * np.pi * np.arange(750) / 500)])

    assert not any(s.motion == "sine" for s in segment(np.append(motion, np.linspace(-0.01, 0, 400)), 0.2)[0])


def test_slow_sine_has_no_holds_at_its_turning_points():
    assert segment(np.concatenate([sine(0.025, 1, 8), sine(0.005, 0.25, 16)]), 0.1)[1] == [
        "25mm_1Hz_0.1V",
        "5mm_0.25Hz_0.1V",
    ]


def test_triangle_is_not_a_sine():
    time = np.arange(5000) / 500
    triangle = 0.01 * (2 / np.pi) * np.arcsin(np.sin(2 * np.pi * time))

    assert segment(triangle, 0.2)[1] == ["other_0.2V"]


@pytest.mark.parametrize("rise", [0.04, 0.2])
def test_sweep_is_not_a_sine(rise):
    time = np.arange(10000) / 500
    sweep = 0.01 * np.sin(2 * np.pi * (0.5 * time + rise / 2 * time**2))

    assert segment(sweep, 0.2)[1] == ["other_0.2V"]


def test_repeated_names_are_numbered():
    assert segment(sine(0.01, 1, 12), staircase((0.1, 0.4, 0.1), 4))[1] == [
        "10mm_1Hz_0.1V",
        "10mm_1Hz_0.4V",
        "10mm_1Hz_0.1V_2",
    ]


def test_channels_of_different_length_are_refused():
    with pytest.raises(ValueError, match="differ in length"):
        find_segments(np.arange(3.0), np.zeros(2), np.zeros(3), 1.0)


def read(path):
    with gzip.open(path, "rt") as file:
        names = file.readline().strip().split(",")
        return dict(zip(names, np.loadtxt(file, delimiter=",").T, strict=True))


def real(path, drive):
    columns = read(path)
    rate = 1 / np.median(np.diff(columns["time_s"]))
    return find_segments(columns["time_s"], columns["displacement_m"], columns[drive], rate), rate


def test_steady_cycles_of_every_real_sine_are_one_segment():
    for path in sorted((shared_folder() / "data" / "utfsm_sine").glob("*.csv.gz")):
        segments, rate = real(path, "current_a")
        steady = [segment for segment in segments if segment.motion == "sine"]
        assert [segment.motion for segment in segments] == ["hold", "other", "sine", "other", "hold"], path.name
        nominal = float(path.name.split("_")[1].removesuffix("Hz"))
        assert steady[0].frequency == pytest.approx(nominal, rel=0.03)
        assert (steady[0].stop - steady[0].start) / rate * nominal > 4


def test_real_random_recording_is_one_random_segment_and_the_rest_after_it():
    segments, _ = real(shared_folder() / "data" / "nees_dyke" / "ranran_50.csv.gz", "voltage_v")

    assert [segment.motion for segment in segments] == ["random", "hold"]
    assert segments[0].drive_value is None


def changing_strokes(seed):
    """Strokes of changing amplitude and frequency; the drive changes near the boundaries, levels in any order."""
    chance = np.random.default_rng(seed)
    rate = float(chance.choice([200.0, 500.0, 1000.0]))
    count = int(chance.integers(12, 25) * rate)
    amplitude, frequency, drive = np.zeros(count), np.zeros(count), np.zeros(count)
    start = 0
    while start < count:
        stop = start + int(chance.uniform(0.8, 4) * rate)
        amplitude[start:stop] = chance.choice([2e-3, 5e-3, 1e-2, 2e-2])
        frequency[start:stop] = chance.choice([0.5, 1.0, 2.0, 3.0])
        start = stop
        drive[max(0, min(count - 1, start + int(chance.normal(0, 0.05) * rate))) :] = chance.choice(SIX)
    fade = np.ones(int(0.05 * rate) + 1) / (int(0.05 * rate) + 1)
    amplitude = np.convolve(np.pad(amplitude, 50, mode="edge"), fade, mode="same")[50:-50]
    return amplitude * np.sin(2 * np.pi * np.cumsum(frequency) / rate), drive, rate


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1))
@example(160)
@example(1103)
@example(1409)
def test_segments_are_never_empty_and_have_no_gaps(seed):
    displacement, drive, rate = changing_strokes(seed)
    segments, _ = segment(displacement, drive, rate, seed=seed)
    assert all(segment.stop > segment.start for segment in segments)


def test_short_excursion_of_the_drive_does_not_divide_a_sine_and_a_long_one_does():
    short, long = np.full(3000, 0.2), np.full(3000, 0.2)
    short[1500:1550] = 0.4
    long[1000:1500] = np.linspace(0.2, 0.5, 500)

    assert segment(sine(0.01, 1, 6), short)[1] == ["10mm_1Hz_0.2V"]
    assert segment(sine(0.01, 1, 6), long)[1] == ["10mm_1Hz_0.2V", "10mm_1Hz", "10mm_1Hz_0.2V_2"]
