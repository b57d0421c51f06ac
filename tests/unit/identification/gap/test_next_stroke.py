from dataclasses import replace

import numpy as np

from bench.methods.compile import compile_method
from bench.methods.document import Method, Segment
from identification.damper.coordinates import to_coordinates
from identification.damper.effects import EFFECTS
from identification.damper.parameter_sets import PARAMETER_SETS
from identification.gap.next_stroke import Limits, Rival, best_segment, trials
from identification.simulate import ActiveEffect

POINT = to_coordinates(PARAMETER_SETS["laboratory"].parameters)
LIMITS = Limits(amplitude=0.015, centre=0.0, velocity=0.2, frequency=3.0, drives=(0.0, 0.5))


def rival(name, *values):
    active = ActiveEffect(EFFECTS[name], values)
    return Rival((name,), POINT, (active,), 0.5, 0.0, np.diag(np.full(13 + len(values), 1e-6)))


def test_one_set_leaves_nothing_open():
    assert best_segment([rival("moving_mass", 2.0)], POINT, LIMITS, 2.0) is None


def test_delay_and_mass_are_separated_inside_the_limits():
    found = best_segment([rival("moving_mass", 2.0), rival("force_delay", 1e-3)], POINT, LIMITS, 2.0)
    segment = Segment.model_validate(found.segment)
    motion = segment.motion
    assert motion.amplitude_m <= LIMITS.amplitude * 1.001
    assert 2 * np.pi * motion.amplitude_m * motion.frequency_hz <= LIMITS.velocity * 1.01
    assert found.separates == [["moving_mass"], ["force_delay"]]
    assert found.detectability > 10.0


def test_what_a_refit_takes_away_does_not_count():
    loose = rival("moving_mass", 0.05)
    tight = replace(loose, information=np.diag(np.full(14, 1e12)))
    other = rival("force_delay", 2e-4)
    other = replace(other, information=tight.information)
    free = best_segment([loose, other], POINT, LIMITS, 2.0)
    held = best_segment([tight, other], POINT, LIMITS, 2.0)
    assert held.detectability >= free.detectability


def test_error_of_the_forms_hides_a_difference_as_noise_does():
    rivals = [rival("moving_mass", 2.0), rival("force_delay", 1e-3)]
    sharp = best_segment(rivals, POINT, LIMITS, 2.0)
    blurred = best_segment([replace(r, left=0.3) for r in rivals], POINT, LIMITS, 2.0)
    assert blurred.detectability < 0.5 * sharp.detectability


def test_what_a_stroke_does_not_move_hides_no_refit_of_the_rest():
    surely = np.diag(np.full(14, 1e-6))
    surely[POINT._fields.index("eta")] *= 1e14
    mass = (ActiveEffect(EFFECTS["moving_mass"], (0.5,)),)
    damped = POINT._replace(c0_a=1.01 * POINT.c0_a)
    rivals = [Rival((name,), point, mass, 0.5, 0.0, surely) for name, point in (("one", POINT), ("other", damped))]
    found = best_segment(rivals, POINT, LIMITS, 2.0)
    assert found.difference > 0.1
    assert found.detectability < 0.05 * found.difference / 2.0 * np.sqrt(6000)


def test_the_bench_compiles_every_segment_that_may_be_proposed():
    for segment, stroke in trials(LIMITS):
        document = {
            "schema": "mrbench.method/1",
            "name": "next",
            "title": "Proposed",
            "description": "One segment.",
            "rate_hz": 1000.0,
            "drive_kind": "coil_v",
            "limits": {
                "stroke_m": 0.05,
                "velocity_mps": 1.0,
                "acceleration_mps2": 30.0,
                "force_n": 5000.0,
                "drive": 0.5,
            },
            "segments": [segment],
        }
        programme = compile_method(Method.model_validate(document))
        assert len(programme.displacement) >= len(stroke.displacement)
