"""Random draw of a trial's cases: kinds in fixed proportions, everything else by the seed."""

from collections.abc import Iterator, Sequence
from itertools import cycle, islice
from typing import Any, NamedTuple

import numpy as np

from sim_rig.effect_forms import FORMS, Place
from sim_rig.errors import TrialError
from sim_rig.trial.cases.parameter_values import compute_measures, draw_values
from sim_rig.trial.cases.sizing import compute_noise_floor, find_size, make_sizing_model
from sim_rig.trial.cases.specimens import SIZES, draw_specimen, make_scenario_document
from sim_rig.trial.cases.strokes import VARIANTS, compute_duration, make_strokes
from sim_rig.trial.cases.truth import CaseKind, Magnitude, MethodKind, TrueCase, TrueEffect

CASE_COUNTS: dict[CaseKind, int] = {"single": 58, "nothing": 100, "pair": 33, "unknown": 30, "triple": 9}
"""Number of cases of each kind among 230."""
RATIOS: dict[Magnitude, tuple[float, float]] = {"small": (1.05, 1.5), "large": (1.7, 5.0)}
"""[1] error of the refitted law over the noise floor for each effect, to first order; a full refit is lower."""
ROTATION: tuple[tuple[Magnitude, MethodKind], ...] = (
    *(("small", "rich"), ("large", "rich"), ("small", "poor")),
    *(("large", "rich"), ("small", "rich"), ("large", "poor")),
)
"""Sizes and methods of the cases of a kind, in turn; poor methods have one amplitude at one frequency."""
GRID_RATIOS = (1.02, 1.05, 1.1, 1.2, 1.4, 1.8, 3.0)
"""[1] ratios of a detection curve."""
MIN_SIZE_FRACTION = 0.75
"""[1] least part of the requested excess that an effect must reach; otherwise another one replaces it."""
EFFECT_COUNTS: dict[CaseKind, int] = {"nothing": 0, "single": 1, "pair": 2, "triple": 3, "unknown": 1}
"""Number of effects in a case of each kind."""
KNOWN_FORMS = tuple(form.form for form in FORMS.values() if form.in_library)
UNKNOWN_FORMS = tuple(form.form for form in FORMS.values() if not form.in_library)


class SampledCase(NamedTuple):
    """One case before the sizes of its effects are chosen."""

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


def draw_cases(cases: int, seed: int) -> list[SampledCase]:
    """Draw the blind mixture: kinds, sizes, methods and effects in turn, so that its start is a fair sample."""
    random = np.random.default_rng([seed, 1])
    known, unknown = _cycle_forms(KNOWN_FORMS, random), _cycle_forms(UNKNOWN_FORMS, random)
    positions = {kind: int(random.integers(len(ROTATION))) for kind in CASE_COUNTS}
    sampled = []
    for number, kind in enumerate(_interleave_kinds(CASE_COUNTS, cases)):
        magnitude, method = ROTATION[positions[kind] % len(ROTATION)]
        positions[kind] += 1
        forms = _choose_forms(known if kind != "unknown" else unknown, EFFECT_COUNTS[kind])
        ratios = tuple(float(random.uniform(*RATIOS[magnitude])) for _ in forms)
        sampled.append(_make_case(number, kind, magnitude if forms else None, method, forms, ratios, random))
    return sampled


def draw_grid(cases: int, seed: int) -> list[SampledCase]:
    """Draw single library effects over a grid of sizes with rich methods, for a detection curve."""
    random = np.random.default_rng([seed, 2])
    grid = [(form, ratio) for ratio in GRID_RATIOS for form in random.permutation(KNOWN_FORMS)]
    return [
        _make_case(
            number,
            "single",
            "small" if ratio <= RATIOS["small"][1] else "large",
            "rich",
            (str(form),),
            (ratio,),
            random,
        )
        for number, (form, ratio) in enumerate(islice(cycle(grid), cases))
    ]


def size_case(sampled: SampledCase, seed: int) -> TrueCase:
    """Choose the sizes of a case's effects, by simulations of its strokes.

    An effect that cannot be large enough under this method is replaced by another one.

    Raises:
        TrialError: no effect can be large enough.
    """
    random = np.random.default_rng([seed, 3, sampled.number])
    noise = _draw_load_cell(sampled, random)
    effects: list[TrueEffect] = []
    for form, ratio in zip(sampled.forms, sampled.ratios, strict=True):
        effects.append(
            _size_effect(sampled, form, ratio, effects, seed, compute_noise_floor(sampled.damper, noise), random)
        )
    scenario = make_scenario_document(
        sampled.damper,
        draw_specimen(sampled.damper, seed),
        alternative_effects=[{"name": e.name, "form": e.form, "parameters": e.parameters} for e in effects],
        sensors={"force": noise},
    )
    return TrueCase(
        id=f"case_{sampled.number:03d}",
        kind=sampled.kind,
        magnitude=sampled.magnitude,
        method=sampled.method,
        variant=sampled.variant,
        damper=sampled.damper,
        noise="coloured" if sampled.noise == "coloured" else "white",
        effects=tuple(effects),
        seed=sampled.seed,
        scenario=scenario,
    )


def _size_effect(
    sampled: SampledCase,
    form: str,
    ratio: float,
    others: Sequence[TrueEffect],
    seed: int,
    noise: float,
    random: np.random.Generator,
) -> TrueEffect:
    """Return the effect with this form, or with the first other form that can be large enough with the others."""
    candidates = [*UNKNOWN_FORMS] if sampled.kind == "unknown" else [*KNOWN_FORMS]
    taken = {effect.form for effect in others} | set(sampled.forms)
    spares = [str(name) for name in random.permutation(candidates) if name not in taken]
    strokes = make_strokes(sampled.method, sampled.damper, seed, sampled.variant)
    measures = compute_measures(
        sampled.damper, compute_duration(strokes), max(stroke.amplitude for stroke in strokes)
    )
    model = make_sizing_model(sampled.damper, sampled.method, seed, sampled.variant)
    target = noise * float(np.sqrt(ratio**2 - 1))
    for name in [form, *spares]:
        if not _is_compatible(name, [effect.form for effect in others]):
            continue
        effect: dict[str, Any] = {"name": FORMS[name].effect, "form": name}
        effect["parameters"] = draw_values(name, random, measures)
        sized, excess = find_size(effect, target, model.compute_residual)
        if excess > MIN_SIZE_FRACTION * target:
            ratio_alone = float(np.hypot(1, excess / noise))
            return TrueEffect(
                stage=FORMS[name].stage, in_library=FORMS[name].in_library, ratio=round(ratio_alone, 4), **sized
            )
    raise TrialError(
        f"case {sampled.number}: no effect reaches {ratio:.3g} times the noise under its strokes; use another seed"
    )


def _draw_load_cell(sampled: SampledCase, random: np.random.Generator) -> dict[str, Any]:
    """Draw the force channel: noise of its range, white or with a coloured part."""
    size = SIZES[sampled.damper].noise * float(random.uniform(0.8, 1.3))
    cell = {"resolution": 0.05, "limit": 2e4, "zero_spread": 2.0, "filter": {}, "delay": 2e-4, "jitter": 1e-6}
    if sampled.noise == "white":
        return {**cell, "noise": size}
    slow = {"slow_noise": 0.5 * size, "slow_noise_time": float(random.uniform(0.02, 0.1))}
    return {**cell, "noise": 0.87 * size, **slow}


def _make_case(
    number: int,
    kind: CaseKind,
    magnitude: Magnitude | None,
    method: MethodKind,
    forms: tuple[str, ...],
    ratios: tuple[float, ...],
    random: np.random.Generator,
) -> SampledCase:
    damper, noise = str(random.choice(list(SIZES))), str(random.choice(["white", "white", "coloured"]))
    variant, seed = int(random.integers(VARIANTS)), int(random.integers(2**31))
    return SampledCase(number, kind, magnitude, method, variant, damper, noise, forms, ratios, seed)


def _interleave_kinds(proportions: dict[CaseKind, int], count: int) -> Iterator[CaseKind]:
    """Yield ``count`` kinds, evenly interleaved: the next is the one furthest behind its proportion."""
    taken = dict.fromkeys(proportions, 0)
    total = sum(proportions.values())
    for position in range(1, count + 1):
        kind = max(proportions, key=lambda kind: proportions[kind] / total * position - taken[kind])
        taken[kind] += 1
        yield kind


def _cycle_forms(forms: Sequence[str], random: np.random.Generator) -> Iterator[str]:
    """Yield every form once, then every form once again in another order."""
    while True:
        yield from (str(form) for form in random.permutation(forms))


def _choose_forms(forms: Iterator[str], count: int) -> tuple[str, ...]:
    """Return the next forms that can be active at the same time."""
    chosen: list[str] = []
    while len(chosen) < count:
        form = next(forms)
        if form not in chosen and _is_compatible(form, chosen):
            chosen.append(form)
    return tuple(chosen)


def _is_compatible(form: str, others: Sequence[str]) -> bool:
    """Return whether a form can be active with others: only one can act in the mounting."""
    in_mounting = FORMS[form].place is Place.MOUNTING
    return not (in_mounting and any(FORMS[other].place is Place.MOUNTING for other in others))
