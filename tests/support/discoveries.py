"""Effects outside the library, pools of short recordings with them, and what a search finds in these."""

from functools import cache
from types import SimpleNamespace

import numpy as np

from identification.damper.definitions import STAGE_OF, EffectFile, EffectParameter, FunctionKind, make_effect
from identification.damper.effects import Place, Variable
from identification.fitting import Piece, Problem
from identification.fitting.search_space import SearchSpace
from identification.gap.discovery.curve_effects import CURVE_PLACES, CurveEffect, CurvePlace, list_curve_effects
from identification.gap.discovery.curve_fit import FittedCurve, fit_best_curves, screen_curves
from identification.gap.discovery.discover import DiscoveredEffect, discover_effect
from identification.simulate import ActiveEffect, Excitation
from tests.support.candidate_pools import WatchedPool, fit_baseline
from tests.support.fit_problems import RATE, SCALES

LENGTH = 0.012
"""Largest displacement of the recordings [m]."""
THREE_LEVELS = (0.0, 0.5, 0.25)


def define(
    place: Place, expression: str, variables: tuple[Variable, ...], kind: FunctionKind = "value", **values: float
) -> ActiveEffect:
    """Return an active effect of an expression and its parameters."""
    parameters = {name: EffectParameter(value=v, unit="1", lo=-1e9, hi=1e9) for name, v in values.items()}
    file = EffectFile(
        name=f"own_{place}",
        stage=STAGE_OF[place],
        place=place,
        kind=kind,
        variables=list(variables),
        expression=expression,
        parameters=parameters,
    )
    return ActiveEffect(make_effect(file), tuple(values.values()))


GAIN = define(
    "damper_gain", f"a*(displacement/{LENGTH})**2+b*(displacement/{LENGTH})**3", ("displacement",), a=0.4, b=0.3
)
"""Gain of the damper that rises towards one end."""
GROWING = define(
    "parallel_force", f"(1+g*drive)*a*(displacement/{LENGTH})**2", ("displacement", "drive"), g=6.0, a=30.0
)
"""Force over the displacement that grows with the drive."""
SPRING = define("parallel_force", f"a*(displacement/{LENGTH})**2", ("displacement",), a=40.0)
"""Force over the displacement that does not grow with the drive."""
WAVE = define("parallel_force", "a*sin(displacement/s)", ("displacement",), a=40.0, s=0.003)
"""Force over the displacement in a form that no effect of the library has."""
FILM = define(
    "parallel_force",
    "velocity*a*exp(-travel_since_reversal/s)",
    ("travel_since_reversal", "velocity"),
    a=600.0,
    s=0.002,
)
"""Film that damps the first millimetres after a reversal."""
MOUNTING = define("mounting", "a*acceleration*abs(acceleration)", ("acceleration",), a=5.0)
"""Force of the mounting, proportional to the square of the acceleration."""


@cache
def pool_with(*effects: ActiveEffect) -> WatchedPool:
    """Return a pool of a short recording with some effects; it is not to be changed."""
    return fit_baseline(*effects)


@cache
def fitted_with(*effects: ActiveEffect) -> FittedCurve:
    """Return the curve with the largest linear evidence, fitted."""
    pool = pool_with(*effects)
    return fit_best_curves(pool, pool.baseline, screen_curves(pool, pool.baseline)[:1])[0]


@cache
def discovered_with(*effects: ActiveEffect) -> DiscoveredEffect | None:
    """Return what a search with the law alone finds."""
    pool = pool_with(*effects)
    return discover_effect(pool, pool.baseline)


def make_stroke(levels: tuple[float, ...] = THREE_LEVELS, seconds: float = 1.5, size: float = 0.01) -> Excitation:
    """Return a sine with drive levels one after the other, and a power that is not constant."""
    t = np.arange(round(seconds * RATE)) / RATE
    drive = np.array(levels)[np.minimum((t * len(levels) / seconds).astype(int), len(levels) - 1)]
    w = 4.0 * np.pi
    x, v = size * np.sin(w * t), size * w * np.cos(w * t)
    return Excitation(RATE, x, v, -w * w * x, drive, start=2.0, power=(100.0 + 300.0 * drive) * np.abs(v))


def make_problem(*strokes: Excitation, scales=SCALES) -> Problem:
    """Return a problem of strokes whose forces are zero."""
    pieces = tuple(Piece(f"s{i}", s, np.zeros(len(s.drive)), np.ones(len(s.drive))) for i, s in enumerate(strokes))
    drives = np.concatenate([s.drive for s in strokes])
    return Problem(pieces, SearchSpace(float(drives.min()), float(drives.max()), scales), 1.0, 2e-5)


def make_curves(*strokes: Excitation, scales=SCALES) -> dict[CurvePlace, CurveEffect]:
    """Return the curves that strokes show, by their places."""
    forces = [200.0 * np.tanh(s.velocity / 0.01) + 1000.0 * s.velocity for s in strokes]
    return {c.at: c for c in list_curve_effects(make_problem(*strokes, scales=scales), forces)}


@cache
def all_curves() -> dict[CurvePlace, CurveEffect]:
    """Return a curve at every place, from a stroke at three drives."""
    curves = make_curves(make_stroke())
    assert set(curves) == set(CURVE_PLACES)
    return curves


def find_curve(place: Place, *variables: Variable) -> CurveEffect:
    """Return the curve over some variables at a place."""
    return next(c for at, c in all_curves().items() if (at.place, at.variables) == (place, variables))


def collect_all_variables(stroke: Excitation) -> dict[str, np.ndarray]:
    """Return arbitrary values of every variable, as many as a stroke has samples."""
    random = np.random.default_rng(7)
    names = {name for at in CURVE_PLACES for name in at.variables}
    values = {name: random.standard_normal(len(stroke.drive)) for name in sorted(names)}
    return values | {"drive": stroke.drive, "velocity": stroke.velocity, "displacement": stroke.displacement}


def make_curve_stub(
    place: Place, variables: tuple[Variable, ...], function, *, grows: bool = False, period: float | None = None
):
    """Return a stand-in of a curve that has exactly the values of a function of the variable."""
    basis = SimpleNamespace(size=1, evaluate=lambda variable, coefficients: coefficients[0] * function(variable))
    at = CurvePlace(place, variables, grows, period=period)
    return SimpleNamespace(at=at, function=SimpleNamespace(scale=1.0, basis=basis), unit=find_unit(at))


def find_unit(at: CurvePlace) -> str:
    """Return the unit of the curves at a place."""
    return next(c.unit for known, c in all_curves().items() if known.place == at.place)
