"""Compliance of the fixture: a spring between load cell and damper, in series with it.

The damper lags the actuator by the spring's elongation, and its force depends on its own displacement and
velocity. Both are solved together. A fixture of screws and plates hardens as its gaps close. This is gradual
(``stiffening``), or sudden where a badly tightened joint is soft until its faces touch (``closing_joint``).
Compliance in front of the load cell is not part of this effect, because the displacement is measured behind it.
"""

from typing import Any

from identification.damper.effects.effect import Effect, Form
from identification.damper.parameters import Quantity


def make_linear_spring(compliance: Any) -> Any:
    """Return compliance [m/N], gap [m], hardening [1/m²], film damping [N s/m] and in-gap stiffness ratio [1]."""
    return compliance, 0.0, 0.0, 0.0, 0.0


def make_hardening_spring(compliance: Any, hardening: Any) -> Any:
    """Return the same five numbers for a spring that hardens."""
    return compliance, 0.0, hardening, 0.0, 0.0


def make_closing_joint(compliance: Any, load: Any, ratio: Any) -> Any:
    """Return the same five numbers for a joint that is soft until its faces touch."""
    return compliance / ratio, 2.0 * compliance * load, 0.0, 0.0, 1.0 / ratio


FIXTURE_COMPLIANCE = Effect(
    name="fixture_compliance",
    stage="mounting",
    variable="force",
    meaning="the fixture deforms under the force, so the damper moves less than the actuator",
    forms=(
        Form(
            "linear",
            "connection",
            (Quantity("compliance", "m/N", 0.0, 1e-4, 1e-6, "compliance of the fixture"),),
            ((5e-8,), (3e-7,), (2e-6,)),
            make_linear_spring,
        ),
        Form(
            "stiffening",
            "connection",
            (
                Quantity("compliance", "m/N", 0.0, 1e-4, 1e-6, "compliance of the fixture under a small load"),
                Quantity(
                    "hardening", "1/m^2", 0.0, 1e12, 1e7, "growth of its stiffness over the squared elongation"
                ),
            ),
            ((1e-7, 1e7), (4e-7, 1e7)),
            make_hardening_spring,
        ),
        Form(
            "closing_joint",
            "connection",
            (
                Quantity("compliance", "m/N", 0.0, 1e-4, 1e-6, "compliance of the fixture before its faces touch"),
                Quantity("load", "N", 0.1, 1e5, 100.0, "load at which the faces touch"),
                Quantity("ratio", "1", 1.0, 6.0, 1.0, "stiffness beyond that load over the stiffness below it"),
            ),
            ((5e-8, 100.0, 2.0), (4e-7, 100.0, 2.0), (4e-7, 500.0, 2.0)),
            make_closing_joint,
        ),
    ),
)
