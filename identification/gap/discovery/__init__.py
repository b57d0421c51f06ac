"""Discovery of causes outside the library, as curves over the variables of each place and as formulas."""

from identification.gap.discovery.curve_fit import FittedCurve
from identification.gap.discovery.discover import DiscoveredEffect, discover_effect
from identification.gap.discovery.formula_fit import make_curve_file, update_values
from identification.gap.discovery.unlisted_cause import compare_with_curves, locate_unlisted_cause

__all__ = [
    "DiscoveredEffect",
    "FittedCurve",
    "compare_with_curves",
    "discover_effect",
    "locate_unlisted_cause",
    "make_curve_file",
    "update_values",
]
