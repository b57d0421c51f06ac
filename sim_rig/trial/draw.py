"""Which cases a trial has: kinds in fixed shares, everything else by the seed."""

from collections.abc import Iterator, Sequence
from itertools import cycle, islice
from typing import Any, NamedTuple

import numpy as np

from sim_rig.errors import TrialError
from sim_rig.scenarios.sealed import FORMS, Place
from sim_rig.trial.calibrate import bench_for, floor, sized
from sim_rig.trial.specimens import SIZES, scenario_document, specimen
from sim_rig.trial.strokes import VARIANTS, duration, strokes
from sim_rig.trial.truth import CaseKind, Magnitude, MethodKind, TrueCase, TrueEffect
from sim_rig.trial.values import drawn_values, measures

SHARES: dict[CaseKind, int] = {"single": 58, "nothing": 100, "pair": 33, "unknown": 30, "triple": 9}
"""Cases of each kind among 230."""
RATIOS: dict[Magnitude, tuple[float, float]] = {"small": (1.05, 1.5), "large": (1.7, 5.0)}
"""[1] refitted law over the noise floor, effect by effect, to first order; a whole refit leaves rather less."""
TURNS: tuple[tuple[Magnitude, MethodKind], ...] = (
    *(("small", "rich"), ("large", "rich"), ("small", "poor")),
    *(("large", "rich"), ("small", "rich"), ("large", "poor")),
)
"""Sizes and methods that the cases of a kind take in turn; poor methods have one amplitude at one frequency."""
GRID = (1.02, 1.05, 1.1, 1.2, 1.4, 1.8, 3.0)
"""[1] ratios of a detection curve."""
REACHED = 0.75
"""[1] part of the wanted excess that an effect has to have, or another one takes its place."""
COUNT: dict[CaseKind, int] = {"nothing": 0, "single": 1, "pair": 2, "triple": 3, "unknown": 1}
KNOWN = tuple(form.form for form in FORMS.values() if form.known)
UNKNOWN = tuple(form.form for form in FORMS.values() if not form.known)


class Drawn(NamedTuple):
    """One case before its sizes are chosen."""

    number: int
    kind: CaseKind
    magnitude: Magnitude | None
    method: MethodKind
    variant: int
    damper: str
    noise: str
    forms: tuple[str, ...]
    ratios: tuple[float, ...]
    seed: int


def draw(cases: int, seed: int) -> list[Drawn]:
    """The blind mixture: kinds, sizes, methods and effects in turn, so that its beginning is a fair sample too."""
    chance = np.random.default_rng([seed, 1])
    known, unknown = _in_turn(KNOWN, chance), _in_turn(UNKNOWN, chance)
    turns = {kind: int(chance.integers(len(TURNS))) for kind in SHARES}
    drawn = []
    for number, kind in enumerate(_spread(SHARES, cases)):
        magnitude, method = TURNS[turns[kind] % len(TURNS)]
        turns[kind] += 1
        forms = _together(known if kind != "unknown" else unknown, COUNT[kind])
        ratios = tuple(float(chance.uniform(*RATIOS[magnitude])) for _ in forms)
        drawn.append(_case(number, kind, magnitude if forms else None, method, forms, ratios, chance))
    return drawn


def draw_grid(cases: int, seed: int) -> list[Drawn]:
    """Single known effects over a grid of sizes, rich methods: what a detection curve needs."""
    chance = np.random.default_rng([seed, 2])
    grid = [(form, ratio) for ratio in GRID for form in chance.permutation(KNOWN)]
    return [
        _case(
            number,
            "single",
            "small" if ratio <= RATIOS["small"][1] else "large",
            "rich",
            (str(form),),
            (ratio,),
            chance,
        )
        for number, (form, ratio) in enumerate(islice(cycle(grid), cases))
    ]


def settle(drawn: Drawn, seed: int) -> TrueCase:
    """A drawn case with its sizes: heavy, as the strokes are simulated for it.

    An effect that cannot be large enough under this method gives its place to another one.

    Raises:
        TrialError: no effect can be.
    """
    chance = np.random.default_rng([seed, 3, drawn.number])
    noise = _load_cell(drawn, chance)
    effects: list[TrueEffect] = []
    for form, ratio in zip(drawn.forms, drawn.ratios, strict=True):
        effects.append(_effect(drawn, form, ratio, effects, seed, floor(drawn.damper, noise), chance))
    scenario = scenario_document(
        drawn.damper,
        specimen(drawn.damper, seed),
        sealed=[{"name": e.name, "form": e.form, "parameters": e.parameters} for e in effects],
        sensors={"force": noise},
    )
    return TrueCase(
        id=f"case_{drawn.number:03d}",
        kind=drawn.kind,
        magnitude=drawn.magnitude,
        method=drawn.method,
        variant=drawn.variant,
        damper=drawn.damper,
        noise="coloured" if drawn.noise == "coloured" else "white",
        effects=tuple(effects),
        seed=drawn.seed,
        scenario=scenario,
    )


def _effect(
    drawn: Drawn,
    form: str,
    ratio: float,
    beside: Sequence[TrueEffect],
    seed: int,
    noise: float,
    chance: np.random.Generator,
) -> TrueEffect:
    """The effect with this form, or with the first other one that can be large enough beside the others."""
    others = [*UNKNOWN] if drawn.kind == "unknown" else [*KNOWN]
    taken = {effect.form for effect in beside} | set(drawn.forms)
    spares = [str(name) for name in chance.permutation(others) if name not in taken]
    planned = strokes(drawn.method, drawn.damper, seed, drawn.variant)
    measured = measures(drawn.damper, duration(planned), max(stroke.amplitude for stroke in planned))
    bench = bench_for(drawn.damper, drawn.method, seed, drawn.variant)
    wanted = noise * float(np.sqrt(ratio**2 - 1))
    for name in [form, *spares]:
        if not _fits(name, [effect.form for effect in beside]):
            continue
        chosen: dict[str, Any] = {"name": FORMS[name].effect, "form": name}
        chosen["parameters"] = drawn_values(name, chance, measured)
        found, excess = sized(chosen, wanted, bench.excess)
        if excess > REACHED * wanted:
            alone = float(np.hypot(1, excess / noise))
            return TrueEffect(stage=FORMS[name].stage, known=FORMS[name].known, ratio=round(alone, 4), **found)
    raise TrialError(f"case {drawn.number}: no effect reaches {ratio:.3g} times the noise under its strokes")


def _load_cell(drawn: Drawn, chance: np.random.Generator) -> dict[str, Any]:
    """The force channel: noise of its range, white or with a coloured part."""
    size = SIZES[drawn.damper].noise * float(chance.uniform(0.8, 1.3))
    cell = {"resolution": 0.05, "limit": 2e4, "zero_spread": 2.0, "filter": {}, "delay": 2e-4, "jitter": 1e-6}
    if drawn.noise == "white":
        return {**cell, "noise": size}
    slow = {"slow_noise": 0.5 * size, "slow_noise_time": float(chance.uniform(0.02, 0.1))}
    return {**cell, "noise": 0.87 * size, **slow}


def _case(
    number: int,
    kind: CaseKind,
    magnitude: Magnitude | None,
    method: MethodKind,
    forms: tuple[str, ...],
    ratios: tuple[float, ...],
    chance: np.random.Generator,
) -> Drawn:
    damper, noise = str(chance.choice(list(SIZES))), str(chance.choice(["white", "white", "coloured"]))
    variant, seed = int(chance.integers(VARIANTS)), int(chance.integers(2**31))
    return Drawn(number, kind, magnitude, method, variant, damper, noise, forms, ratios, seed)


def _spread(shares: dict[CaseKind, int], count: int) -> Iterator[CaseKind]:
    """``count`` names in these shares, each spread evenly: the one that is most behind its share is next."""
    taken = dict.fromkeys(shares, 0)
    whole = sum(shares.values())
    for place in range(1, count + 1):
        name = max(shares, key=lambda kind: shares[kind] / whole * place - taken[kind])
        taken[name] += 1
        yield name


def _in_turn(forms: Sequence[str], chance: np.random.Generator) -> Iterator[str]:
    """Every form once, then every form once again in another order."""
    while True:
        yield from (str(form) for form in chance.permutation(forms))


def _together(forms: Iterator[str], count: int) -> tuple[str, ...]:
    """The next forms that can be at work at the same time."""
    chosen: list[str] = []
    while len(chosen) < count:
        form = next(forms)
        if form not in chosen and _fits(form, chosen):
            chosen.append(form)
    return tuple(chosen)


def _fits(form: str, beside: Sequence[str]) -> bool:
    """One connection is all that stands between load cell and damper."""
    connects = FORMS[form].place is Place.CONNECTION
    return not (connects and any(FORMS[other].place is Place.CONNECTION for other in beside))
