"""What planned strokes can tell of a damper: each coordinate's deviation at best, and the stroke to add."""

from dataclasses import dataclass

import numpy as np

from identification.arrays import Array, BoolArray
from identification.damper.coordinates import COORDINATES, Coordinates
from identification.foresight.documents import Foreseen, Foresight, Gain, StrokeToAdd
from identification.foresight.information import information, relative_covariance, seen
from identification.foresight.planned import Addition, Planned
from identification.foresight.words import added, at_best, summary, why_not
from identification.simulate import Stroke

KNOWN = 0.5
"""[1] relative deviation below which a coordinate counts as fixed."""
GOOD = 0.05
"""[1] relative deviation that is good enough: nothing is added for the sake of less."""
_WORTH = 1.3
"""[1] factor by which an addition must better a coordinate that is not good to be named."""
_MOVING = 0.1
"""[1] share of the largest velocity above which the damper counts as inside a stroke."""


@dataclass(frozen=True)
class Assumed:
    """What the strokes are judged with."""

    name: str
    """Of a parameter set, or of the model's file."""
    point: Coordinates
    noise: float
    """[N] of the recorded force."""


def foresee(planned: Planned, assumed: Assumed) -> Foresight:
    """Judge planned strokes, and choose the best of the additions.

    Args:
        planned: the strokes of a method, and those that could be added.
        assumed: the damper and the noise.
    """
    found = information(assumed.point, planned.stroke, assumed.noise)
    visible = seen(found)
    spread = relative_covariance(found)
    coordinates = _judged(planned, assumed, spread, visible)
    addition = _best_addition(planned, assumed, found)
    return Foresight(
        method=planned.method,
        damper=assumed.name,
        noise_n=assumed.noise,
        drive_unit=planned.drive_unit,
        coordinates=coordinates,
        add=addition,
        words=summary(planned.method, assumed.name, assumed.noise, coordinates, addition, GOOD),
    )


def _judged(planned: Planned, assumed: Assumed, spread: Array, visible: BoolArray) -> dict[str, Foreseen]:
    deviations = np.sqrt(np.diag(spread))
    found = {}
    for i, quantity in enumerate(COORDINATES):
        relative = float(deviations[i]) if visible[i] else None
        fixed = relative is not None and relative < KNOWN
        reason = why_not(quantity, _conditions(planned.stroke), _twin(spread, i))
        found[quantity.symbol] = Foreseen(
            value=assumed.point[i],
            unit=quantity.unit_for(planned.drive_unit),
            percent=None if relative is None or relative > 1.0 else _rounded(100 * relative),
            fixed=fixed,
            note=at_best(quantity, relative) if fixed and relative is not None else reason,
        )
    return found


@dataclass(frozen=True)
class Conditions:
    """What a plan lacks, as far as a person can see it."""

    one_drive: bool
    """The drive never changes."""
    steps_at_rest: bool
    """The drive changes only while the damper stands."""
    one_velocity: bool
    """All strokes peak at about the same velocity."""


def _conditions(stroke: Stroke) -> Conditions:
    drive, velocity = stroke.drive_seen, np.abs(stroke.velocity)
    changes = np.flatnonzero(np.abs(np.diff(drive)) > 1e-9)
    fast = velocity > _MOVING * float(velocity.max())
    # Second by second: a sweep or a ramp of amplitude has peaks of many sizes.
    block = max(1, round(stroke.rate))
    peaks = [float(velocity[k : k + block].max()) for k in range(0, len(velocity) - block + 1, block)]
    steady = [peak for peak in peaks if peak > 0.2 * max(peaks)] if peaks else []
    return Conditions(
        one_drive=len(changes) == 0,
        steps_at_rest=not fast[changes].any(),
        one_velocity=not steady or max(steady) < 1.5 * min(steady),
    )


def _twin(spread: Array, i: int) -> tuple[str, float]:
    """The other coordinate that is hardest to tell from this one, and their correlation [1]."""
    sd = np.sqrt(np.diag(spread))
    correlation = spread[i] / (sd * sd[i])
    # Its own, which is one, would win.
    correlation[i] = 0.0
    other = int(np.argmax(np.abs(correlation)))
    return COORDINATES[other].symbol, float(correlation[other])


def _best_addition(planned: Planned, assumed: Assumed, found: Array) -> StrokeToAdd | None:
    """The addition after which the coordinates that are not good yet are the best, if it is worth it."""
    before = np.sqrt(np.diag(relative_covariance(found)))
    poor = before > GOOD
    best: tuple[float, Addition, Array] | None = None
    for addition in planned.additions if poor.any() else ():
        both = found + information(assumed.point, addition.stroke, assumed.noise)
        after = np.sqrt(np.diag(relative_covariance(both)))
        # Better than good earns nothing: a stroke must help where help is needed.
        gain = float(np.log(before[poor] / np.maximum(after[poor], GOOD)).sum())
        if best is None or gain > best[0]:
            best = (gain, addition, after)
    if best is None or not (helped := poor & (before > _WORTH * best[2])).any():
        return None
    return _named(best[1], before, best[2], helped, seen(found))


def _named(addition: Addition, before: Array, after: Array, helped: BoolArray, visible: BoolArray) -> StrokeToAdd:
    gains = {
        q.symbol: Gain(
            before_percent=_rounded(100 * before[i]) if visible[i] and before[i] <= 1.0 else None,
            after_percent=_rounded(100 * after[i]),
        )
        for i, q in enumerate(COORDINATES)
        if helped[i]
    }
    return StrokeToAdd(segment=addition.segment, gains=gains, words=added(addition.segment, gains))


def _rounded(percent: float) -> float:
    return float(f"{percent:.2g}")
