"""Processor time, and a reference kernel that measures the present speed of the machine."""

import time
from collections.abc import Callable
from typing import TypeVar

import numpy as np

Result = TypeVar("Result")


def measure_cpu_time(action: Callable[[], object], repeats: int = 5) -> float:
    """Return the least processor time [s] of some repeats; other processes can only increase it."""
    return min(time_call(action)[1] for _ in range(repeats))


def time_call(function: Callable[[], Result]) -> tuple[Result, float]:
    """Return the result of a function and its processor time [s]."""
    start = time.process_time()
    result = function()
    return result, time.process_time() - start


def measure_reference_time() -> float:
    """Return the processor time [s] of a fixed loop in plain Python, by which machines can be compared."""

    def kernel() -> float:
        total = 0.0
        for i in range(1_000_000):
            total += i * 0.5
        return total

    return measure_cpu_time(kernel, 3)


def print_line(name: str, value: float, unit: str, requirement: str) -> None:
    """Print one result next to its requirement."""
    print(f"  {name:<62} {value:>10.4g} {unit:<8} {requirement}")


def make_sine(amplitude: float, frequency: float, seconds: float, rate: float = 1000.0) -> tuple[np.ndarray, ...]:
    """Return time [s], displacement [m], velocity [m/s] and acceleration [m/s^2] of a sinusoid."""
    t = np.arange(round(seconds * rate)) / rate
    w = 2 * np.pi * frequency
    return t, amplitude * np.sin(w * t), amplitude * w * np.cos(w * t), -amplitude * w * w * np.sin(w * t)
