from collections import Counter
from typing import get_args

import numpy as np
import pytest

from sim_rig.scenarios.sealed import FORMS, Place
from sim_rig.trial import draw as drawing
from sim_rig.trial.calibrate import Bench, sized
from sim_rig.trial.draw import KNOWN, RATIOS, UNKNOWN, Drawn, draw, draw_grid, settle
from sim_rig.trial.specimens import SIZES, specimen
from sim_rig.trial.strokes import RATE, Kind, duration, method_document, samples, strokes
from sim_rig.trial.values import drawn_values, measures


@pytest.fixture(scope="module")
def blind():
    return draw(230, 7)


def test_the_same_seed_draws_the_same_and_another_one_does_not(blind):
    assert draw(230, 7) == blind
    assert draw(230, 8) != blind


def test_kinds_have_their_shares(blind):
    kinds = Counter(case.kind for case in blind)
    assert kinds == {"single": 58, "pair": 33, "triple": 9, "nothing": 100, "unknown": 30}


def test_the_beginning_is_a_fair_sample(blind):
    for count in (46, 115):
        kinds = Counter(case.kind for case in blind[:count])
        for kind, share in drawing.SHARES.items():
            assert abs(kinds[kind] - share * count / 230) <= 1


def test_half_are_small_a_third_are_poor_and_every_damper_and_noise_is_there(blind):
    sizes = Counter(case.magnitude for case in blind if case.forms)
    assert abs(sizes["small"] - sizes["large"]) < 0.05 * sum(sizes.values())
    assert abs(Counter(case.method for case in blind)["poor"] - 230 / 3) < 4
    assert {case.damper for case in blind} == set(SIZES)
    assert {case.noise for case in blind} == {"white", "coloured"}


def test_every_effect_has_its_turn(blind):
    counts = Counter(form for case in blind for form in case.forms)
    assert set(counts) == set(FORMS)
    assert max(counts[form] for form in KNOWN) - min(counts[form] for form in KNOWN) <= 2


def test_unknown_ones_are_drawn_for_unknown_cases_alone(blind):
    for case in blind:
        assert all((form in UNKNOWN) == (case.kind == "unknown") for form in case.forms)


def test_ratios_are_those_of_the_magnitude(blind):
    for case in blind:
        for ratio in case.ratios:
            low, high = RATIOS[case.magnitude]
            assert low <= ratio <= high


def test_two_connections_never_stand_together(blind):
    for case in blind:
        assert sum(FORMS[form].place is Place.CONNECTION for form in case.forms) <= 1
        assert len(set(case.forms)) == len(case.forms)


def test_a_grid_takes_every_effect_through_every_size():
    cases = draw_grid(16 * len(drawing.GRID), 3)
    assert Counter((c.forms[0], c.ratios[0]) for c in cases) == Counter(
        (f, r) for f in KNOWN for r in drawing.GRID
    )
    assert {case.kind for case in cases} == {"single"}


@pytest.mark.parametrize("kind", get_args(Kind))
@pytest.mark.parametrize("size", SIZES)
def test_methods_stay_within_what_the_damper_stands_and_two_minutes(kind, size):
    planned = strokes(kind, size, 4, 1)
    displacement, drive = samples(planned)
    assert np.max(np.abs(displacement)) <= SIZES[size].stroke
    assert np.max(np.abs(np.diff(displacement))) * RATE < 0.5
    assert (drive.min(), drive.max()) == (0.0, SIZES[size].drive)
    assert len(displacement) == len(drive) + 1
    assert duration(planned) < 120
    moving = [stroke for stroke in planned if stroke.amplitude]
    assert len({stroke.frequency for stroke in moving}) == {"poor": 1, "unseen_poor": 2}.get(kind, 5)
    names = [segment["name"] for segment in method_document("m", size, planned)["segments"]]
    assert len(set(names)) == len(names)


def test_a_run_that_no_diagnosis_sees_has_other_strokes():
    for method in ("rich", "poor"):
        seen, unseen = strokes(method, "middle", 4, 1), strokes(f"unseen_{method}", "middle", 4, 1)
        assert not {s.frequency for s in seen if s.amplitude} & {s.frequency for s in unseen if s.amplitude}


def test_a_damper_follows_from_its_seed_and_is_none_that_ships():
    assert specimen("small", 3) == specimen("small", 3)
    assert specimen("small", 3) != specimen("small", 4)


def test_values_lie_within_the_bounds_of_their_form():
    chance = np.random.default_rng(1)
    for size in SIZES:
        measured = measures(size, 60.0, SIZES[size].stroke)
        for name, form in FORMS.items():
            values = drawn_values(name, chance, measured)
            assert list(values) == [quantity.symbol for quantity in form.parameters]
            assert all(q.low <= values[q.symbol] <= q.high for q in form.parameters)


def test_a_size_is_found_whose_excess_is_the_wanted_one():
    effect = {"name": "seal_friction", "form": "lugre", "parameters": {"sliding": 1.0, "peak": 0.7}}
    found, excess = sized(effect, 2.0, lambda tried: 0.03 * tried["parameters"]["sliding"] ** 1.6)
    assert excess == pytest.approx(2.0, rel=0.06)
    assert found["parameters"]["sliding"] == pytest.approx((2.0 / 0.03) ** (1 / 1.6), rel=0.05)
    assert found["parameters"]["peak"] == 0.7


def test_a_size_that_cannot_be_reached_comes_with_less():
    effect = {"name": "magnetic_remanence", "form": "closing_loop", "parameters": {"share": 0.3, "width": 0.1}}
    found, excess = sized(effect, 5.0, lambda tried: tried["parameters"]["share"])
    assert (found["parameters"]["share"], excess) == (1.0, 1.0)


@pytest.fixture(scope="module")
def bench():
    time = np.arange(2001) / RATE
    drive = np.where(time[:-1] < 1, 0.1, 0.4)
    return Bench("small", specimen("small", 1), 0.008 * np.sin(4 * np.pi * time), drive)


def test_what_the_law_can_take_up_is_no_excess(bench):
    """A gas column that is long against the stroke is nearly the law's own straight spring."""
    straight = {"preload": 90.0, "length": 1.0, "exchange": 60.0}
    bent = {"preload": 90.0, "length": 0.025, "exchange": 60.0}
    gas = {"name": "gas_spring", "form": "gas_with_wall"}
    assert bench.excess({**gas, "parameters": straight}) < 0.02 * bench.excess({**gas, "parameters": bent})


def test_an_error_of_the_displacement_channel_has_an_excess_too(bench):
    error = {"name": "displacement_nonlinearity", "form": "uneven_winding"}
    assert bench.excess({**error, "parameters": {"error": 2e-4, "place": 3e-3, "width": 4e-3}}) > 1.0


def test_a_settled_case_has_the_ratio_that_was_drawn(monkeypatch, bench):
    monkeypatch.setattr(drawing, "bench_for", lambda *_: bench)
    drawn = Drawn(3, "pair", "large", "poor", 0, "small", "coloured", ("lugre", "warm_up_and_walk"), (2.0, 3.0), 9)
    case = settle(drawn, 1)
    assert [effect.name for effect in case.effects] == ["seal_friction", "force_drift"]
    assert [effect.ratio for effect in case.effects] == pytest.approx([2.0, 3.0], rel=0.06)
    assert case.scenario["sealed"] == [
        {"name": e.name, "form": e.form, "parameters": e.parameters} for e in case.effects
    ]
    assert case.scenario["sensors"]["force"]["slow_noise"] > 0
    assert settle(drawn, 1) == case


def test_an_effect_that_cannot_show_gives_its_place_to_another(monkeypatch, bench):
    """Under one constant drive no lag of the coil can be seen."""
    time = np.arange(1001) / RATE
    still = Bench("small", specimen("small", 1), 0.008 * np.sin(4 * np.pi * time), np.full(1000, 0.2))
    monkeypatch.setattr(drawing, "bench_for", lambda *_: still)
    drawn = Drawn(0, "single", "large", "poor", 0, "small", "white", ("eddy_ladder",), (3.0,), 9)
    (effect,) = settle(drawn, 1).effects
    assert effect.form != "eddy_ladder"
    assert effect.known
