"""Compiled trajectories of the law with chosen effects, and their exact sensitivities."""

from identification.simulate.kernel import Plan
from identification.simulate.setting import UNKNOWNS, ActiveEffect, Setting, Stroke, Trajectory
from identification.simulate.trajectory import FINENESS, simulate

__all__ = ["FINENESS", "UNKNOWNS", "ActiveEffect", "Plan", "Setting", "Stroke", "Trajectory", "simulate"]
