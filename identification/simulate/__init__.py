"""Compiled trajectories of the law with chosen effects, and their exact sensitivities."""

from identification.simulate.kernel import Plan
from identification.simulate.trajectory import (
    FINENESS,
    UNKNOWNS,
    ActiveEffect,
    Setting,
    Stroke,
    Trajectory,
    simulate,
)

__all__ = ["FINENESS", "UNKNOWNS", "ActiveEffect", "Plan", "Setting", "Stroke", "Trajectory", "simulate"]
