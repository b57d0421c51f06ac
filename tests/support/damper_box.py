"""Box of laboratory dampers, for tests that draw a damper anywhere in it."""

from typing import NamedTuple


class Range(NamedTuple):
    """Range of one coordinate of the law, in SI units."""

    symbol: str
    low: float
    high: float


LABORATORY_BOX = (
    Range("F_a", 0.1, 5e3),
    Range("F_b", 0.0, 2e4),
    Range("D_y", 1e-6, 5e-3),
    Range("rho", 0.02, 0.98),
    Range("n", 1.0, 6.0),
    Range("eta", 2.0, 2e3),
    Range("c0_a", 1.0, 1e5),
    Range("c0_b", -1e5, 1e5),
    Range("c1_a", 100.0, 1e7),
    Range("c1_b", -1e7, 1e7),
    Range("k0", -1e5, 1e5),
    Range("k1", -1e5, 1e5),
    Range("f0", -1e4, 1e4),
)
