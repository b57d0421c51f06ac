"""Methods as samples: continuous, exact, repeatable, and within their limits."""

from dataclasses import fields

import numpy as np
import pytest
from pydantic import ValidationError

from bench.errors import MethodError
from bench.methods import Method, Programme, compile_method, list_shipped_methods, load_method

SINE = {"kind": "sine", "amplitude_m": 0.01, "frequency_hz": 2}
MULTISINE = {
    "kind": "multisine",
    "lines": [{"frequency_hz": 0.5, "amplitude_m": 0.004}, {"frequency_hz": 0.7, "amplitude_m": 0.003}],
    "seed": 3,
}
RANDOM = {"kind": "random", "spectrum": {"low_hz": 0.5, "high_hz": 6, "rms_m": 0.002}, "seed": 4}
TABLE = {"kind": "table", "time_s": [0, 0.4, 1, 2], "displacement_m": [0.002, 0.006, -0.003, 0.002]}
RAMP = {"kind": "ramp", "start_m": 0.005, "end_m": -0.01, "corner_acceleration_mps2": 0.5}
MOTIONS = {
    "hold": {"motion": {"kind": "hold"}, "duration_s": 1.5},
    "ramp": {"motion": RAMP, "duration_s": 1.2},
    "sine": {"motion": SINE, "cycles": 3},
    "sine_for_a_time": {"motion": SINE, "duration_s": 1.5},
    "triangle": {"motion": {**SINE, "kind": "triangle", "corner_acceleration_mps2": 3}, "cycles": 3},
    "sweep": {"motion": {"kind": "sweep", "amplitude_m": 0.006, "start_hz": 0.5, "end_hz": 4}, "duration_s": 4},
    "log_sweep": {
        "motion": {"kind": "sweep", "amplitude_m": 0.006, "start_hz": 4, "end_hz": 0.5, "law": "logarithmic"},
        "duration_s": 4,
    },
    "multisine": {"motion": MULTISINE, "cycles": 1},
    "multisine_for_a_time": {"motion": MULTISINE, "duration_s": 2.35},
    "random": {"motion": RANDOM, "duration_s": 4},
    "table": {"motion": TABLE, "cycles": 2},
}
DRIVES = {
    "constant": {"kind": "constant", "value": 0.2},
    "staircase": {"kind": "staircase", "levels": [0.1, 0.3]},
    "steps": {"kind": "steps", "values": [0.1, 0.4, 0.2], "time_s": [0, 0.4, 0.9]},
    "steps_at_phases": {"kind": "steps", "values": [0.1, 0.4, 0.2], "phase_cycles": [0, 0.25, 2.5]},
    "ramp": {"kind": "ramp", "start": 0.1, "end": 0.5},
    "prbs": {"kind": "prbs", "low": 0.1, "high": 0.4, "bit_s": 0.05, "seed": 7},
    "table": {"kind": "table", "values": [0, 0.4, 0.1], "time_s": [0, 1, 2]},
}


def method(*segments: dict[str, object], **changes: object) -> Method:
    """Return a method of segments, with names and drives filled in."""
    return Method.model_validate(
        {
            "schema": "mrbench.method/1",
            "name": "trial",
            "title": "t",
            "description": "d",
            "rate_hz": 1000,
            "drive_kind": "coil_v",
            "limits": {
                "stroke_m": 0.05,
                "velocity_mps": 1,
                "acceleration_mps2": 50,
                "force_n": 900,
                "drive": 0.5,
            },
            "segments": [
                {"name": f"s{index}", "drive": DRIVES["constant"], **segment}
                for index, segment in enumerate(segments)
            ],
            **changes,
        }
    )


def counted(programme: Programme, channel: str, index: int = 0) -> np.ndarray:
    segment = programme.segments[index]
    return getattr(programme, channel)[segment.start : segment.stop]


EVERYTHING = method(
    *({**motion, "centre_m": 0.002 * (index % 3)} for index, motion in enumerate(MOTIONS.values())),
    conditioning={
        "before": {"warm_up": {"motion": SINE, "cycles": 2, "drive": DRIVES["constant"]}, "rest_s": 0.3},
        "between": {"rest_s": 0.2},
    },
)


@pytest.fixture(scope="module")
def everything() -> Programme:
    return compile_method(EVERYTHING)


def test_displacement_changes_no_faster_than_its_velocity(everything):
    steps = np.abs(np.diff(everything.displacement))
    fastest = np.maximum(np.abs(everything.velocity[1:]), np.abs(everything.velocity[:-1]))
    assert np.all(steps <= (fastest + 0.03) / everything.rate)


def test_velocity_never_jumps(everything):
    hardest = np.abs(everything.acceleration).max()
    assert np.abs(np.diff(everything.velocity)).max() <= 1.01 * hardest / everything.rate


def test_velocity_is_the_derivative_of_displacement(everything):
    numerical = np.gradient(everything.displacement, 1 / everything.rate)
    assert np.abs(numerical - everything.velocity)[1:-1].max() < 2e-3
    assert np.sqrt(np.mean((numerical - everything.velocity) ** 2)) < 5e-5


def test_acceleration_is_the_derivative_of_velocity(everything):
    numerical = np.gradient(everything.velocity, 1 / everything.rate)
    off = np.abs(numerical - everything.acceleration)
    assert np.quantile(off, 0.99) < 0.02


def test_a_programme_begins_and_ends_at_rest_at_zero(everything):
    for channel in (everything.displacement, everything.velocity):
        assert channel[0] == 0
        assert channel[-1] == pytest.approx(0, abs=1e-12)


def test_exactly_the_samples_of_a_segment_have_its_index(everything):
    for segment in everything.segments:
        assert np.all(everything.segment[segment.start : segment.stop] == segment.index)
    inside = sum(segment.stop - segment.start for segment in everything.segments)
    assert np.count_nonzero(everything.segment >= 0) == inside


@pytest.mark.parametrize("name", MOTIONS)
def test_the_derivatives_of_a_motion_are_exact(name):
    programme = compile_method(method(MOTIONS[name], rate_hz=4000))
    step = 1 / programme.rate
    numerical = np.gradient(counted(programme, "displacement"), step)[1:-1]
    assert numerical == pytest.approx(counted(programme, "velocity")[1:-1], abs=1e-4)
    area = np.cumsum(counted(programme, "acceleration")) * step
    change = counted(programme, "velocity") - counted(programme, "velocity")[0]
    assert np.abs(area - change).max() < 2e-2


@pytest.mark.parametrize("name", ["sine", "triangle", "multisine", "table"])
def test_a_periodic_segment_contains_whole_cycles(name):
    wanted = MOTIONS[name]
    programme = compile_method(method(wanted))
    samples = counted(programme, "displacement")
    cycles = wanted["cycles"]
    one = len(samples) // cycles
    assert len(samples) == one * cycles
    assert samples[one:] == pytest.approx(samples[:-one] if cycles > 1 else samples[one:], abs=1e-12)
    after = programme.displacement[programme.segments[0].stop]
    assert after == pytest.approx(samples[0], abs=1e-9)


def test_the_common_cycle_of_a_multisine_is_that_of_all_its_lines():
    assert len(counted(compile_method(method(MOTIONS["multisine"])), "time")) == 10_000


def test_a_sine_is_the_sine():
    programme = compile_method(method(MOTIONS["sine"]))
    local = np.arange(1500) / 1000
    assert counted(programme, "displacement") == pytest.approx(0.01 * np.sin(4 * np.pi * local), abs=1e-12)
    segment = programme.segments[0]
    assert (segment.amplitude, segment.frequency, segment.drive_value) == (0.01, 2, 0.2)


def test_a_triangle_reaches_its_amplitude_and_keeps_its_corner_acceleration():
    programme = compile_method(method(MOTIONS["triangle"]))
    assert np.abs(counted(programme, "displacement")).max() == pytest.approx(0.01, rel=1e-4)
    assert np.abs(counted(programme, "acceleration")).max() == pytest.approx(3)
    constant = np.abs(counted(programme, "acceleration")) == 0
    assert np.ptp(np.abs(counted(programme, "velocity")[constant])) < 1e-12


def test_a_triangle_without_straight_parts_is_continuous():
    needed = 32 * 0.01 * 2**2
    programme = compile_method(
        method({"motion": {**SINE, "kind": "triangle", "corner_acceleration_mps2": needed}, "cycles": 2})
    )
    assert np.abs(np.diff(programme.velocity)).max() < 1e-2


def test_a_triangle_whose_acceleration_no_number_can_hold_is_refused():
    motion = {**SINE, "kind": "triangle", "frequency_hz": 1e200, "corner_acceleration_mps2": 3}
    with pytest.raises(ValidationError, match="need at least inf m/s²"):
        method({"motion": motion, "cycles": 2})


def test_a_ramp_goes_from_rest_to_rest_at_constant_velocity():
    programme = compile_method(method(MOTIONS["ramp"]))
    way = counted(programme, "displacement")
    assert way[0] == pytest.approx(0.005)
    assert way[-1] == pytest.approx(-0.01, abs=1e-5)
    velocity = counted(programme, "velocity")
    assert np.count_nonzero(np.isclose(velocity, velocity.min(), rtol=1e-9)) > 500


@pytest.mark.parametrize(("name", "first", "last"), [("sweep", 0.5, 4.0), ("log_sweep", 4.0, 0.5)])
def test_a_sweep_runs_from_its_first_to_its_last_frequency(name, first, last):
    programme = compile_method(method(MOTIONS[name]))
    speed = np.hypot(
        counted(programme, "velocity"), 2 * np.pi * first * counted(programme, "displacement")
    )  # amplitude times angular frequency at the very start
    assert speed[0] == pytest.approx(0.006 * 2 * np.pi * first)
    turns = np.count_nonzero(np.diff(np.sign(counted(programme, "displacement")[1:])))
    mean = 2.25 if name == "sweep" else 3.5 / np.log(8)
    assert turns == pytest.approx(2 * mean * 4, abs=1.1)
    assert last in (0.5, 4.0)


def test_a_sweep_at_constant_frequency_is_a_sine():
    motion = {"kind": "sweep", "amplitude_m": 0.01, "start_hz": 2, "end_hz": 2, "law": "logarithmic"}
    swept = compile_method(method({"motion": motion, "duration_s": 1.5}))
    assert swept.displacement == pytest.approx(compile_method(method(MOTIONS["sine"])).displacement, abs=1e-9)


def test_a_random_motion_has_the_given_rms_and_band():
    segment = {"motion": RANDOM, "duration_s": 60}
    displacement = counted(compile_method(method(segment)), "displacement")
    assert np.sqrt(np.mean(displacement**2)) == pytest.approx(0.002, rel=0.05)
    power = np.abs(np.fft.rfft(displacement * np.hanning(len(displacement)))) ** 2
    frequency = np.fft.rfftfreq(len(displacement), 1e-3)
    in_band = (frequency > 0.45) & (frequency < 6.05)
    assert power[in_band].sum() > 0.999 * power.sum()


def test_a_table_passes_through_its_points():
    programme = compile_method(method(MOTIONS["table"]))
    displacement = counted(programme, "displacement")
    assert displacement[[0, 400, 1000, 2000, 2400]] == pytest.approx([0.002, 0.006, -0.003, 0.002, 0.006])


@pytest.mark.parametrize("name", ["multisine", "random"])
def test_the_same_seed_gives_the_same_motion_and_another_seed_another(name):
    segment = MOTIONS[name]
    other = {**segment, "motion": {**segment["motion"], "seed": 99}}
    first, again, different = (compile_method(method(one)).displacement for one in (segment, segment, other))
    assert np.array_equal(first, again)
    assert not np.allclose(first, different)


def test_the_same_seed_gives_the_same_bits_and_another_seed_others():
    segment = {**MOTIONS["random"], "drive": DRIVES["prbs"]}
    other = {**segment, "drive": {**DRIVES["prbs"], "seed": 8}}
    first, again, different = (compile_method(method(one)).drive for one in (segment, segment, other))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, different)


def test_a_binary_drive_has_two_values_on_its_bit_grid():
    programme = compile_method(method({**MOTIONS["random"], "drive": DRIVES["prbs"]}))
    drive = counted(programme, "drive")
    assert set(drive) == {0.1, 0.4}
    assert np.all(np.flatnonzero(np.diff(drive)) % 50 == 49)


def test_levels_of_a_staircase_are_separate_segments_of_one_continuous_stroke():
    segment = {**MOTIONS["sine"], "cycles": 4, "name": "x", "drive": DRIVES["staircase"]}
    programme = compile_method(method(segment))
    assert [(one.name, one.drive, one.drive_value) for one in programme.segments] == [
        ("x_0.1V", "constant", 0.1),
        ("x_0.3V", "constant", 0.3),
    ]
    assert programme.segments[0].stop == programme.segments[1].start
    assert set(counted(programme, "drive", 0)) == {0.1}
    assert set(counted(programme, "drive", 1)) == {0.3}
    assert abs(counted(programme, "velocity", 1)[0]) == pytest.approx(0.04 * np.pi)


def test_repeated_levels_are_numbered():
    drive = {"kind": "staircase", "levels": [0.1, 0.3, 0.1]}
    programme = compile_method(method({**MOTIONS["sine"], "name": "x", "drive": drive}))
    assert [one.name for one in programme.segments] == ["x_0.1V", "x_0.3V", "x_0.1V_2"]


def test_only_the_last_level_of_a_staircase_is_a_checkpoint():
    segment = {**MOTIONS["sine"], "cycles": 4, "checkpoint": True, "drive": DRIVES["staircase"]}
    assert [one.checkpoint for one in compile_method(method(segment)).segments] == [False, True]


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("constant", {0: 0.2, 1499: 0.2}),
        ("steps", {0: 0.1, 399: 0.1, 400: 0.4, 899: 0.4, 900: 0.2}),
        ("steps_at_phases", {0: 0.1, 124: 0.1, 125: 0.4, 1249: 0.4, 1250: 0.2}),
        ("ramp", {0: 0.1, 750: 0.3}),
        ("table", {0: 0.0, 500: 0.2, 1000: 0.4, 1200: 0.34}),
    ],
)
def test_a_drive_has_the_given_value_at_each_sample(name, expected):
    drive = counted(compile_method(method({**MOTIONS["sine"], "drive": DRIVES[name]})), "drive")
    assert {sample: drive[sample] for sample in expected} == pytest.approx(expected)


def test_before_and_after_a_segment_the_drive_keeps_its_end_values():
    programme = compile_method(method({**MOTIONS["sine"], "drive": DRIVES["ramp"], "centre_m": 0.01}))
    segment = programme.segments[0]
    assert set(programme.drive[: segment.start]) == {0.1}
    assert programme.drive[segment.stop :] == pytest.approx(0.5)


def test_the_strokes_of_the_warm_up_belong_to_no_segment(everything):
    first = everything.segments[0]
    assert np.abs(everything.displacement[: first.start]).max() == pytest.approx(0.01, rel=1e-3)
    assert np.all(everything.segment[: first.start] == -1)


def test_no_cycle_is_lost_at_a_rate_that_does_not_divide_the_cycle():
    programme = compile_method(method({**MOTIONS["sine"], "cycles": 20}, rate_hz=937.0))
    assert len(counted(programme, "time")) == pytest.approx(20 * 0.5 * 937, abs=1)


@pytest.mark.parametrize("name", list_shipped_methods())
def test_every_shipped_method_compiles_within_its_limits(name):
    programme = compile_method(load_method(name))
    limits = programme.method.limits
    assert np.abs(programme.displacement).max() <= limits.stroke_m
    assert np.abs(programme.velocity).max() <= limits.velocity_mps
    assert all(np.isfinite(getattr(programme, one.name)).all() for one in fields(programme)[2:8])


def test_shipped_methods_have_their_documented_durations():
    length = {name: compile_method(load_method(name)).duration for name in list_shipped_methods()}
    assert 600 < length["paper_sines"] < 614
    assert 20 < length["quick"] < 25
    assert 75 < length["identification"] < 95
    assert length["six_voltages"] < 70


def test_validation_shares_no_stroke_and_no_drive_with_identification():
    strokes, drives = (
        [
            {getattr(segment, field) for segment in compile_method(load_method(name)).segments}
            for name in ("validation", "identification")
        ]
        for field in ("amplitude", "drive_value")
    )
    assert not strokes[0] & strokes[1]
    assert not drives[0] & drives[1]


@pytest.mark.parametrize(
    ("limit", "message"),
    [
        ({"stroke_m": 0.009}, r"segment s0: displacement -?0.01 m exceeds the limit of 0.009 m; lower"),
        ({"velocity_mps": 0.12}, r"velocity -?0.1257 m/s exceeds the limit of 0.12 m/s"),
        ({"acceleration_mps2": 1.5}, r"acceleration -?1\.\d+ m/s² exceeds the limit of 1.5 m/s²"),
        ({"drive": 0.1}, r"drive 0.2 V exceeds the limit of 0.1 V"),
    ],
)
def test_an_exceeded_limit_is_refused_with_value_and_limit(limit, message):
    limits = method(MOTIONS["sine"]).limits.model_dump() | limit
    with pytest.raises(MethodError, match=message):
        compile_method(method(MOTIONS["sine"], limits=limits))


def test_message_on_a_limit_exceeded_between_segments_names_the_position():
    limits = method(MOTIONS["sine"]).limits.model_dump() | {"acceleration_mps2": 1.6}
    sharp = {**MOTIONS["sine"], "fade_s": 0.1}
    with pytest.raises(MethodError, match=r"(before segment s0|after the last segment): acceleration"):
        compile_method(method(sharp, limits=limits))


@pytest.mark.parametrize(
    ("segment", "message"),
    [
        ({"motion": SINE, "duration_s": 1.3}, "1.3 s is 2.6 cycles, but whole cycles are needed"),
        ({"motion": {"kind": "hold"}, "cycles": 2}, "a hold has no cycles; give duration_s"),
        ({"motion": TABLE, "duration_s": 2}, "the duration of a table is that of its points"),
        (
            {"motion": {**TABLE, "displacement_m": [0, 0, 0, 0.1]}, "cycles": 2},
            "must end at its first position; it starts at 0 m and ends at 0.1 m",
        ),
        ({"motion": {**SINE, "frequency_hz": 200}, "cycles": 2}, "200 Hz needs 10 samples per cycle.* 2000"),
        ({"motion": {"kind": "hold"}, "duration_s": 0.001}, "fewer than 2 samples"),
        ({"motion": RAMP, "duration_s": 0.1}, "needs corner_acceleration_mps2 of at least 6 m/s², not 0.5"),
        ({"motion": RANDOM, "duration_s": 1}, "5.5 lines of this band, fewer than 10"),
        (
            {"motion": MULTISINE, "duration_s": 2, "drive": DRIVES["steps_at_phases"]},
            "drive steps at phases need whole cycles",
        ),
        (
            {"motion": {"kind": "hold"}, "duration_s": 2, "drive": DRIVES["steps_at_phases"]},
            "drive steps at phases need whole cycles, but this hold",
        ),
        (
            {"motion": SINE, "cycles": 2, "drive": {"kind": "constant", "value": 0}, "shunt": True},
            'the shunt needs a rod at rest without drive, not sine with constant drive; use motion "hold"',
        ),
        (
            {"motion": {"kind": "hold"}, "duration_s": 2, "drive": DRIVES["staircase"], "shunt": True},
            "the shunt needs a rod at rest without drive, not hold with staircase drive",
        ),
        (
            {
                "motion": {"kind": "hold"},
                "duration_s": 2,
                "drive": {"kind": "constant", "value": 0.1},
                "shunt": True,
            },
            "the shunt needs a rod at rest without drive",
        ),
        (
            {"motion": SINE, "cycles": 3, "drive": DRIVES["staircase"]},
            "3 cycles cannot be divided into 2 levels of whole cycles",
        ),
    ],
)
def test_an_inconsistent_segment_is_refused(segment, message):
    with pytest.raises(MethodError, match=message):
        compile_method(method(segment))


def test_a_method_with_too_many_samples_is_refused():
    with pytest.raises(MethodError, match="samples, more than 1000; divide it into several runs"):
        compile_method(method(MOTIONS["sine"]), max_samples=1000)


def test_a_segment_with_the_shunt_is_marked_in_the_programme():
    segments = compile_method(load_method("shunt_check")).segments
    assert [(one.name, one.shunt) for one in segments] == [
        ("settle", False), ("rest", False), ("shunt", True), ("rest_after", False)
    ]  # fmt: skip
