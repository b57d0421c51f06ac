"""Benchmarks of the physics-informed networks."""

from benchmarks.pinn.cases import LABORATORY, make_random_recording

__all__ = [
    "LABORATORY",
    "make_random_recording",
]
