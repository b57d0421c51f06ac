"""A fixture that gives way: a spring between load cell and damper, in series with it.

The damper stands behind by the stretch of the spring, and its force depends on where and how fast it moves: the
two are solved together. A spring of screws and plates hardens as its gaps close, little by little or all at once:
a joint that was tightened badly is soft until its faces touch. Give in front of the load cell is no effect: the
displacement is measured behind it.
"""

from typing import Any

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity


def linear(compliance: Any) -> Any:
    """Give [m/N], gap [m], hardening [1/m²], film [N s/m] and stiffness in the gap [1] of the connection."""
    return compliance, 0.0, 0.0, 0.0, 0.0


def hardening(compliance: Any, hardening: Any) -> Any:
    """The same of a spring that hardens."""
    return compliance, 0.0, hardening, 0.0, 0.0


def closing(compliance: Any, load: Any, ratio: Any) -> Any:
    """The same of a joint that is soft until its faces touch."""
    return compliance / ratio, 2.0 * compliance * load, 0.0, 0.0, 1.0 / ratio


FIXTURE_COMPLIANCE = Effect(
    name="fixture_compliance",
    stage="mounting",
    meaning="the fixture gives way under the force, so the damper moves less than the actuator",
    forms=(
        Form(
            "linear",
            "connection",
            (Quantity("compliance", "m/N", 0.0, 1e-4, 1e-6, "give of the fixture under load"),),
            ((5e-8,), (3e-7,), (2e-6,)),
            linear,
        ),
        Form(
            "stiffening",
            "connection",
            (
                Quantity("compliance", "m/N", 0.0, 1e-4, 1e-6, "give of the fixture under a small load"),
                Quantity("hardening", "1/m²", 0.0, 1e12, 1e7, "growth of its stiffness over the squared stretch"),
            ),
            ((1e-7, 1e7), (4e-7, 1e7)),
            hardening,
        ),
        Form(
            "closing",
            "connection",
            (
                Quantity("compliance", "m/N", 0.0, 1e-4, 1e-6, "give of the fixture before its faces touch"),
                Quantity("load", "N", 0.1, 1e5, 100.0, "load under which they touch"),
                Quantity("ratio", "1", 1.0, 6.0, 1.0, "what the fixture is stiffer then"),
            ),
            ((5e-8, 100.0, 2.0), (4e-7, 100.0, 2.0), (4e-7, 500.0, 2.0)),
            closing,
        ),
    ),
)
