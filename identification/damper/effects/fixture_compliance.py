"""A fixture that gives way: a spring between load cell and damper, in series with it.

The damper stands at x - compliance * force, and its force depends on where and how fast it moves: the two are
solved together. Give in front of the load cell is no effect: the displacement is measured behind it.
"""

from typing import Any

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity


def give(compliance: Any) -> Any:
    """Give of the fixture [m/N]."""
    return compliance


FIXTURE_COMPLIANCE = Effect(
    name="fixture_compliance",
    stage="mounting",
    meaning="the fixture gives way under the force, so the damper moves less than the actuator",
    forms=(
        Form(
            "linear",
            "compliance",
            (Quantity("compliance", "m/N", 0.0, 1e-4, 1e-6, "give of the fixture under load"),),
            ((3e-7,), (2e-6,)),
            give,
        ),
    ),
)
