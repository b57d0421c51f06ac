"""Options of a joint fit."""

from dataclasses import dataclass


@dataclass(frozen=True)
class FitOptions:
    """Decimation, starts and iterations of a joint fit."""

    decimation: int = 4
    """Use every n-th sample until the last descent; 1 uses all from the beginning."""
    starts: int = 6
    """Largest number of starts that are generated from the forms of the effects."""
    descents: int = 2
    """Largest number of starts from which the cost is minimised."""
    iterations: int = 40
    """Largest number of iterations of one descent."""
    regression_start: bool = True
    """Also start from the coordinates of the regression."""
    start_decimation: int = 1
    """Compare starts on every n-th of the decimated samples."""
    law_steps: int = 0
    """Steps of the law alone, with fixed effects, before law and effects move together."""
    tolerance: float = 0.0
    """Part of the excess over the noise that a step must be expected to remove, else a descent ends [1]."""
    refit_full: bool = True
    """Refine the result on all samples; otherwise the results are those of the given problem."""


DEFAULT_OPTIONS = FitOptions()
