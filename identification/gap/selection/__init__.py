"""Selection of the sets of effects that explain a recording."""

from identification.gap.selection.candidate_pool import CandidatePool, CurveAlternative
from identification.gap.selection.extension import settle_floor
from identification.gap.selection.partial_sets import find_partial_sets
from identification.gap.selection.plan import compute_final_posterior, search_forward
from identification.gap.selection.posterior import (
    MAX_TIED_SETS,
    MIN_TIED_PROBABILITY,
    UNKNOWN_THRESHOLD,
    BlockEvidence,
    Posterior,
    compute_log_prior,
    compute_stage_probabilities,
    normalise_scores,
)
from identification.gap.selection.screening import compute_expected_gain
from identification.gap.selection.search_problems import SearchProblems
from identification.gap.selection.search_settings import DEFAULT_SETTINGS, SearchSettings

__all__ = [
    "DEFAULT_SETTINGS",
    "MAX_TIED_SETS",
    "MIN_TIED_PROBABILITY",
    "UNKNOWN_THRESHOLD",
    "BlockEvidence",
    "CandidatePool",
    "CurveAlternative",
    "Posterior",
    "SearchProblems",
    "SearchSettings",
    "compute_expected_gain",
    "compute_final_posterior",
    "compute_log_prior",
    "compute_stage_probabilities",
    "find_partial_sets",
    "normalise_scores",
    "search_forward",
    "settle_floor",
]
