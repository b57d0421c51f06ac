"""Learned residual of a twin: the force that law and named effects leave, as a function of the recorded state.

It serves predictions and names no cause. Physics and residual stay apart in every document.
"""

from identification.residual.learn import ResidualSamples, learn_residual
from identification.residual.learned_residual import LearnedResidual, ResidualForce
from identification.residual.state import State, StateUnits, compute_state

__all__ = [
    "LearnedResidual",
    "ResidualForce",
    "ResidualSamples",
    "State",
    "StateUnits",
    "compute_state",
    "learn_residual",
]
