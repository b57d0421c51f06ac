"""Dampers with a hidden effect that a seed determines, and the file that discloses it."""

from sim_rig.hidden_effect.draw import draw_scenario
from sim_rig.hidden_effect.sizes import SIZE_RANGES
from sim_rig.hidden_effect.truth import Truth, make_truth, write_truth

__all__ = [
    "SIZE_RANGES",
    "Truth",
    "draw_scenario",
    "make_truth",
    "write_truth",
]
