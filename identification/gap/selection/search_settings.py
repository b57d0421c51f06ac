"""Settings of the search for sets of effects."""

from dataclasses import dataclass, replace

from identification.fitting import OptimiserSettings
from identification.gap.fits import NO_GAP_RATIO, FitOptions

SEARCH_TOLERANCE = 1e-4
"""Part of the excess that a step of a search must be expected to remove, else its descent ends [1]."""
QUICK_FIT = FitOptions(
    decimation=1,
    starts=0,
    descents=1,
    iterations=25,
    law_steps=5,
    regression_start=False,
    refit_full=False,
    tolerance=SEARCH_TOLERANCE,
)
"""One descent from the best of the given starts, on decimated data."""
SET_SEARCH = OptimiserSettings(iterations=40, restarts=1, tolerance=SEARCH_TOLERANCE)
"""Search from the regression and, if its minimum is not conclusive, from the low-slip start."""
LAW_SEARCH = replace(SET_SEARCH, restarts=2)
"""Search of the law alone, on which all sets rest: also from the mixed start."""


@dataclass(frozen=True)
class SearchSettings:
    """Limits and thresholds of the search; excesses are relative to the variance of the noise floor."""

    # Data
    decimation_rate: float = 250.0
    """Sampling rate to which recordings are decimated for the search [Hz]; higher where the motion is fast."""
    long_recording: int = 15_000
    """Number of samples above which a recording is decimated further, down to the screening rate."""
    screening_rate: float = 125.0
    """Sampling rate of a screening [Hz], and lowest rate of a search."""

    # End of the search
    fit_budget: int = 60
    """Number of fits after which no further set is started. Origin: the 27 withheld recordings need 43 at most."""
    no_gap_ratio: float = NO_GAP_RATIO
    """Threshold on the baseline's RMSE relative to the noise floor: below it, no effect is searched for."""
    negligible_excess: float = 0.005
    """Threshold on the excess of a set: below it, no further effect is searched for."""
    negligible_share: float = 0.012
    """Part of the baseline's excess that adds to this threshold; less could not pay the complexity penalty."""

    # Forward search
    shortlist_sizes: tuple[int, ...] = (6, 4, 2)
    """Number of effects that are fitted together with no, one and two others."""
    large_excess: float = 2.0
    """Threshold on the baseline's excess: above it, a linear step from the baseline predicts little."""
    large_shortlist: int = 10
    """Number of effects that are fitted alone above this threshold."""
    searched_sets: int = 3
    """Number of sets of each size that are fitted again from the starts of the law alone."""
    small_excess: float = 0.05
    """Threshold on the excess of a set: below it, an effect is only fitted if its expected gain is large."""
    small_excess_gain: float = 0.15
    """Expected gain that counts as large below this threshold, relative to the excess."""
    beam_widths: tuple[int, ...] = (2, 1)
    """Number of sets of one and of two effects that are extended."""
    beam_ratio: float = 3.0
    """Largest excess of an extended set, relative to that of the best set of its size."""
    extension_share: float = 0.9
    """Largest excess of an extended set, relative to that of the set that it grew from."""

    # Backlash and compliance
    mounting_excess: float = 0.02
    """Threshold on the excess of a set: below it, backlash and compliance are not fitted."""
    richer_form_share: float = 0.8
    """Part of a set's excess that a form of a mounting effect may leave for richer ones to be fitted with it."""
    helpful_mounting_share: float = 0.97
    """Part of the excess that a mounting or confusable effect alone may leave to be fitted with others as well."""

    # Exchange
    pruned_sets: int = 2
    """Number of sets that are fitted again without each of their effects."""
    exchange_effects: int = 2
    """Number of effects that are fitted in place of each effect of the best set."""
    exchange_rounds: int = 2
    """Largest number of rounds of exchange."""
    exchange_share: float = 0.9
    """Largest excess after a round, relative to the one before, for another round."""

    # Fits on all samples
    refit_iterations: int = 15
    """Largest number of iterations of one descent on all samples."""
    refit_rounds: int = 3
    """Largest number of descents, each with a new exact simulation."""
    refit_tolerance: float = 1e-3
    """Difference between exact and fast RMSE, relative to the noise floor, at which a full fit has converged."""
    max_refits: int = 6
    """Number of sets that get a full fit because the set before them came out worse on all samples."""

    # Extension of the most probable set
    max_extensions: int = 2
    """Number of effects that are added to the most probable set after its full fit."""
    extension_effects: int = 2
    """Number of effects that are fitted for one extension."""
    max_effects: int = 3
    """Largest number of effects in a set."""
    max_remaining_share: float = 0.2
    """Part of the baseline's excess that a set may leave for an extension to be tried."""
    min_closed_share: float = 0.4
    """Smallest part of the remaining error that a further effect of a set closes, over conditions.

    Origin: missing effects closed 0.49 and more. Repairs of form errors closed up to 0.34, but for 0.42 and 0.68.
    """
    max_partial_effects: int = 5
    """Largest number of effects in a set that is a part of an unknown cause."""
    confusion_penalty: float = 8.0
    """Logarithm of the odds that a confusable effect has to add. Origin: form errors alone brought up to 6."""


DEFAULT_SETTINGS = SearchSettings()
