"""Benchmarks of speed, as ratios to a baseline of the same run."""

from benchmarks.speed.fitting import (
    RISING_LEVELS,
    SHUFFLED_LEVELS,
    TRAINING_STROKES,
    VALIDATION_STROKES,
    draw_damper,
    make_excitation,
    record_forces,
)

__all__ = [
    "RISING_LEVELS",
    "SHUFFLED_LEVELS",
    "TRAINING_STROKES",
    "VALIDATION_STROKES",
    "draw_damper",
    "make_excitation",
    "record_forces",
]
