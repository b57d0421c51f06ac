"""Processor time, and a reference kernel that says how fast this machine is just now."""

import time
from collections.abc import Callable
from typing import TypeVar

import numpy as np

Result = TypeVar("Result")


def measure_cpu_time(action: Callable[[], object], repeats: int = 5) -> float:
    """Least processor time [s] of some repeats: what neighbours add is noise, never a gain."""
    return min(time_call(action)[1] for _ in range(repeats))


def time_call(work: Callable[[], Result]) -> tuple[Result, float]:
    """What some work gives, and the processor time [s] that it took."""
    began = time.process_time()
    result = work()
    return result, time.process_time() - began


def measure_reference_time() -> float:
    """Processor time [s] of a fixed piece of plain Python, to compare machines by."""

    def kernel() -> float:
        total = 0.0
        for i in range(1_000_000):
            total += i * 0.5
        return total

    return measure_cpu_time(kernel, 3)


def print_line(name: str, value: float, unit: str, bar: str) -> None:
    """Print one result beside what is asked of it."""
    print(f"  {name:<62} {value:>10.4g} {unit:<8} {bar}")


def make_sine(amplitude: float, frequency: float, seconds: float, rate: float = 1000.0) -> tuple[np.ndarray, ...]:
    """Time [s], displacement [m], velocity [m/s] and acceleration [m/s^2] of a sinusoid."""
    t = np.arange(round(seconds * rate)) / rate
    w = 2 * np.pi * frequency
    return t, amplitude * np.sin(w * t), amplitude * w * np.cos(w * t), -amplitude * w * w * np.sin(w * t)
