"""Mean square of the error of a model that noise cannot explain."""

from typing import NamedTuple

_CERTAIN = 4.0
"""Distance from noise alone at which an error is certain [standard deviations]."""


class ErrorSquare(NamedTuple):
    """Estimated mean square of an error of the model."""

    square: float
    """[N²]; without an error of the model it is zero on average."""
    deviation: float
    """Its standard deviation from noise alone [N²]."""

    @property
    def lowest(self) -> float:
        """Lower bound of the mean square that is an error of the model [N²]; negative where noise explains all."""
        return self.square - _CERTAIN * self.deviation
