"""Rig signals that a test sets."""

from typing import Any

import numpy as np
import pytest


class FakeSignals:
    """Samples of channels as (instant [ns], value); time stands at ``now``."""

    def __init__(self) -> None:
        self.now = 0
        self.samples: dict[str, list[tuple[int, float]]] = {}
        self.commands: list[tuple[str, float]] = []

    def now_ns(self) -> int:
        return self.now

    def read_latest(self, channel: str, count: int, before_ns: int) -> Any:
        known = [one for one in self.samples.get(channel, []) if one[0] <= before_ns][-count:]
        return np.array([at for at, _ in known], np.int64), np.array([value for _, value in known], float)

    def command(self, channel: str, value: float) -> None:
        self.commands.append((channel, value))


@pytest.fixture
def signals() -> FakeSignals:
    return FakeSignals()
