"""Magnetic remanence: at the same drive the field is higher while the drive falls than while it rises.

The memory is the difference between the field that the damper sees and the coil's own. After a long rise the field
is below the coil's own by the residue, after a long fall above it. In between it follows exponentially over a
width of drive, or as a play operator does.

The Prandtl-Ishlinskii operator is a mean of play operators of different widths (Brokate and Sprekels 1996, ch. 2).
Small reversals then make small loops, and a larger change wipes out the smaller ones before it.

The history of the iron before a recording is not known. Its last part is a parameter: the change to the first
field, over that field. One is a rise from zero, zero is no memory at the first field, and minus one is a fall from
twice that field.
"""

from typing import Any

import numpy as np

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity

_MIN_WIDTH = 1e-6
_PLAYS = 8
"""Number of play operators that represent a distribution of widths."""


def add_remanence(field: Any, remembered: Any, residue: Any, width: Any, initial_rise: Any) -> Any:
    """Return the field that the damper sees [V or A]; the memory is a share [1] of the residue."""
    return field + residue * remembered


def update_remanence(
    remembered: Any, change: Any, position: Any, residue: Any, width: Any, initial_rise: Any
) -> Any:
    """Return the share [1] of the residue after a monotonic change of the field [V or A]."""
    target = -1.0 if change > 0.0 else 1.0
    return target + (remembered - target) * np.exp(-abs(change) / max(width, _MIN_WIDTH))


def add_closing_remanence(
    field: Any, remembered: Any, residue: Any, width: Any, tip: Any, initial_rise: Any
) -> Any:
    """Return the field of a loop whose branches meet again far beyond the field ``tip`` [V or A]."""
    return field + residue * remembered / (1.0 + (field / tip) ** 2)


def update_closing_remanence(
    remembered: Any, change: Any, position: Any, residue: Any, width: Any, tip: Any, initial_rise: Any
) -> Any:
    """Return the share [1] of the residue after a monotonic change of the field [V or A]."""
    target = -1.0 if change > 0.0 else 1.0
    return target + (remembered - target) * np.exp(-abs(change) / max(width, _MIN_WIDTH))


def add_play_remanence(field: Any, remembered: Any, residue: Any, initial_rise: Any) -> Any:
    """Return the field that the damper sees [V or A]; the memory is its difference from the coil's own."""
    return field + remembered


def update_play_remanence(remembered: Any, change: Any, position: Any, residue: Any, initial_rise: Any) -> Any:
    """Return the difference [V or A] after a change of the field."""
    return min(max(remembered - change, -residue), residue)


def add_plays(field: Any, remembered: Any, share: Any, reach: Any, exponent: Any, initial_rise: Any) -> Any:
    """Return the field of which a share [1] follows plays up to a half width ``reach`` [V or A]."""
    return field + share * remembered


def update_play(
    remembered: Any, change: Any, position: Any, share: Any, reach: Any, exponent: Any, initial_rise: Any
) -> Any:
    """Return the difference [V or A] of one play from the field after a change of it."""
    width = reach * position**exponent
    return min(max(remembered - change, -width), width)


_INITIAL_RISE = Quantity(
    "initial_rise",
    "1",
    -1.0,
    1.0,
    1.0,
    "change to the first field, over that field, since the iron had no memory",
    has_natural_limits=True,
)
_RESIDUE = Quantity("residue", "{drive}", 0.0, 1.0, 0.02, "difference that remains after a long change")
_WIDTH = Quantity("width", "{drive}", 5e-3, 5.0, 0.1, "change of drive over which the difference reverses")

MAGNETIC_REMANENCE = Effect(
    name="magnetic_remanence",
    stage="coil",
    variable="drive_history",
    meaning="the iron retains part of its former field",
    forms=(
        Form(
            "exponential",
            "field_memory",
            (_RESIDUE, _WIDTH, _INITIAL_RISE),
            ((0.0, 0.05, 1.0), (0.0, 0.3, 1.0), (0.0, 0.15, 0.0)),
            add_remanence,
            update_remanence,
        ),
        Form(
            "closing",
            "field_memory",
            (
                _RESIDUE,
                _WIDTH,
                Quantity("tip", "{drive}", 0.02, 20.0, 0.5, "field at which half of the difference remains"),
                _INITIAL_RISE,
            ),
            ((0.0, 0.05, 0.4, 1.0), (0.0, 0.15, 0.4, 1.0), (0.0, 0.3, 1.5, 1.0), (0.0, 0.15, 0.4, 0.0)),
            add_closing_remanence,
            update_closing_remanence,
        ),
        Form(
            "play_operator",
            "field_memory",
            (_RESIDUE, _INITIAL_RISE),
            ((0.01, 1.0), (0.04, 1.0), (0.02, 0.0)),
            add_play_remanence,
            update_play_remanence,
        ),
        Form(
            "prandtl_ishlinskii",
            "field_memory",
            (
                Quantity("share", "1", 0.0, 0.95, 0.3, "part of the field that follows plays"),
                Quantity("reach", "{drive}", 5e-3, 5.0, 0.3, "half width of the widest play"),
                Quantity("exponent", "1", 0.2, 5.0, 1.0, "power of position with which widths grow; 1: uniform"),
                _INITIAL_RISE,
            ),
            ((0.3, 0.2, 1.0, 1.0), (0.3, 0.5, 1.0, 1.0), (0.3, 0.3, 1.0, 0.0)),
            add_plays,
            update_play,
            memories=_PLAYS,
        ),
    ),
)
