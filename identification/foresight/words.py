"""What planned strokes can tell, in words that a technician understands."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from identification.damper.parameters import Quantity
from identification.foresight.documents import Foreseen, Gain, StrokeToAdd

if TYPE_CHECKING:
    from identification.foresight.foresee import Conditions

_BY_DRIVE = {"F_b", "c0_b", "c1_b", "eta"}
_ALIKE = 0.9
"""[1] correlation beyond which two coordinates are said to act alike."""


def at_best(quantity: Quantity, relative: float) -> str:
    """Of a coordinate that the strokes fix to a relative deviation [1]."""
    return f"{quantity.meaning}: to {100 * relative:.2g} % at best"


def why_not(quantity: Quantity, conditions: "Conditions", twin: tuple[str, float]) -> str:
    """Of a coordinate that the strokes do not fix, and why."""
    name = f"{quantity.symbol} ({quantity.meaning})"
    if quantity.symbol in _BY_DRIVE and conditions.one_drive:
        return f"{name} cannot be seen: the drive never changes"
    if quantity.symbol == "eta" and conditions.steps_at_rest:
        return f"{name} cannot be seen: the drive never changes inside a stroke"
    other, correlation = twin
    if abs(correlation) > _ALIKE:
        return f"{name} cannot be told from {other}: in these strokes both change the force in the same way"
    if quantity.symbol.startswith("c1") and conditions.one_velocity:
        return f"{name} hardly shows: all strokes are about equally fast, and it rounds the slow ones"
    return f"{name} hardly shows in the force of these strokes"


def summary(
    method: str,
    damper: str,
    noise: float,
    coordinates: Mapping[str, Foreseen],
    add: StrokeToAdd | None,
    good: float,
) -> list[str]:
    """The whole answer, a line each."""
    fixed = [f"{name} {e.percent:g} %" for name, e in coordinates.items() if e.fixed and e.percent is not None]
    lines = [
        f"what {method} can tell of a damper like {damper}, at best, with {noise:g} N of noise in the force: "
        + (", ".join(fixed) or "nothing")
    ]
    lines += [e.note for e in coordinates.values() if not e.fixed]
    if add is not None:
        return [*lines, add.words]
    poor = any(e.percent is None or e.percent > 100 * good for e in coordinates.values())
    within = "no stroke within its limits would tell much more" if poor else "nothing needs to be added"
    return [*lines, within]


def added(segment: Mapping[str, Any], gains: Mapping[str, Gain]) -> str:
    """What a further stroke would do."""
    changes = [f"{name} {_from(gain)} to {gain.after_percent:g} %" for name, gain in gains.items()]
    return f"add {described(segment)}: {', '.join(changes)}"


def _from(gain: Gain) -> str:
    return "from unseen" if gain.before_percent is None else f"from {gain.before_percent:g} %"


def described(segment: Mapping[str, Any]) -> str:
    """A segment of a method in a few words."""
    motion, drive = segment["motion"], segment["drive"]
    seconds = segment.get("duration_s")
    size = f"{1e3 * motion['amplitude_m']:g} mm at {motion['frequency_hz']:g} Hz"
    length = f", {seconds:g} s" if seconds else ""
    return f"a {motion['kind']} of {size}{length}, {_drive_words(drive)}"


def _drive_words(drive: Mapping[str, Any]) -> str:
    match drive["kind"]:
        case "constant":
            return f"at the constant drive {drive['value']:g}"
        case "staircase":
            return f"through the drives {', '.join(f'{level:g}' for level in drive['levels'])}"
        case "steps":
            low, high = min(drive["values"]), max(drive["values"])
            return f"with {len(drive['values'])} drive steps between {low:g} and {high:g} inside the strokes"
        case other:
            return f"with a drive that is a {other}"
