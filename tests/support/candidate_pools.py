"""Candidate pools of short recordings, simulated with effects of the library."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.random import default_rng

from identification.arrays import Array
from identification.fitting import EffectModel
from identification.gap.diagnosis import make_candidate_pool, prepare_recordings
from identification.gap.fits import Candidate, FitOptions
from identification.gap.selection import CandidatePool, SearchSettings
from identification.gap.selection.neighbours import fit_extension
from identification.gap.selection.search_settings import QUICK_FIT
from identification.logs.recording import Recording, Segment
from identification.simulate import ActiveEffect, Excitation, SimulationModel, simulate
from tests.support.effects import LABORATORY, active
from tests.support.strokes import stretch

RATE = 500.0
NOISE = 2.0
STROKES = ((0.012, 1.0, 2.0), (0.006, 3.0, 1.0))
"""Amplitude [m], frequency [Hz] and duration [s] at each drive."""
DRIVES = (0.0, 0.5, 0.2)
_FINE = 10
"""Parts of a sample at which the drive may step."""
BASELINE_FIT = FitOptions(decimation=1, starts=1, descents=1, refit_full=False)


def record(*effects: str | ActiveEffect, seed: int = 1, advances: Sequence[float] = ()) -> Recording:
    """Return nine seconds of the laboratory damper with some effects at their medium sizes.

    The steps of the drive are earlier than their first samples by ``advances`` [samples], tenths of a sample.
    """
    size, rate, drive, segments = _plan()
    angle = 2 * np.pi * np.cumsum(rate) / RATE
    x = size * np.sin(angle)
    v = np.gradient(x) * RATE
    model = SimulationModel(LABORATORY, effects=tuple(active(e) if isinstance(e, str) else e for e in effects))
    fine = np.repeat(drive, _FINE)[: (len(drive) - 1) * _FINE + 1]
    for place, advance in zip(np.flatnonzero(np.diff(drive)) + 1, advances, strict=False):
        fine[place * _FINE - round(advance * _FINE) : place * _FINE] = drive[place]
    stroke = Excitation(RATE, x, v, np.gradient(v) * RATE, fine, drive_oversampling=_FINE)
    force = simulate(model, stroke).force
    random = default_rng(seed)
    displacement = x + 1e-6 * random.standard_normal(len(x))
    recorded = stretch(displacement, force + NOISE * random.standard_normal(len(x)), drive, segments, rate=RATE)
    metadata = {"run": {"source": "import", "specimen": "LAB-001"}}
    return Recording(Path("short.mcap"), "0" * 64, "coil_v", "V", (recorded,), metadata)


def _plan() -> tuple[Array, Array, Array, list[Segment]]:
    """Return amplitude [m], frequency [Hz] and drive [V] of every sample, and the segments."""
    rows, segments, start = [], [], 0
    for size, rate, seconds in STROKES:
        for level in DRIVES:
            count = round(seconds * RATE)
            name = f"{1e3 * size:g}mm_{rate:g}Hz_{level:g}V"
            segments.append(Segment(len(segments), name, start, start + count, "sine", size, rate, level))
            rows.append(np.tile([size, rate, level], (count, 1)))
            start += count
    table = np.concatenate(rows)
    smooth = np.hanning(61) / np.hanning(61).sum()
    blended = [np.convolve(np.pad(table[:, k], 30, "edge"), smooth, "valid") for k in (0, 1)]
    return blended[0], blended[1], table[:, 2], segments


@dataclass
class WatchedPool(CandidatePool):
    """A candidate pool that records the effects and starts of its fits."""

    fitted: list[tuple[EffectModel, ...]] = field(default_factory=list)
    starts: list[Sequence[Array]] = field(default_factory=list)

    def fit_law(self) -> Candidate:
        self.fitted.append(())
        self.starts.append(())
        return super().fit_law()

    def fit(
        self, effects: tuple[EffectModel, ...], starts: Sequence[Array] = (), options: FitOptions = QUICK_FIT
    ) -> Candidate:
        self.fitted.append(effects)
        self.starts.append(starts)
        return super().fit(effects, starts, options)

    def copy(self, **settings: float) -> "WatchedPool":
        """Return a pool with the same candidates, no recorded fits, and other settings."""
        return replace(
            self,
            problems=replace(self.problems, settings=replace(self.settings, **settings)),
            candidates=dict(self.candidates),
            full_fits=set(self.full_fits),
            block_evidence=dict(self.block_evidence),
            notes=[],
            fitted=[],
            starts=[],
        )

    def extend(self, *names: str) -> frozenset[str]:
        """Fit the baseline with one effect after the other, each in its best form; return the set of all."""
        candidate = self.baseline
        for name in names:
            gains = self.screen(candidate, candidate.names)
            candidate = fit_extension(self, candidate, next(g for g in gains if g.effect_model.name == name))
        return candidate.names

    def get_excess(self, *names: str) -> float:
        """Return the excess of a fitted set."""
        return self.compute_excess(self.candidates[frozenset(names)])


def make_pool(*effects: str | ActiveEffect, **settings: float) -> WatchedPool:
    """Return an empty pool of a short recording."""
    return make_pool_of(record(*effects), **settings)


def make_pool_of(recording: Recording, **settings: float) -> WatchedPool:
    """Return an empty pool of a recording."""
    prepared = prepare_recordings([recording])
    pool = make_candidate_pool(prepared, settings=SearchSettings(**settings))
    return WatchedPool(pool.problems, pool.evaluation, pool.noise_model, pool.clock_deviation)


def fit_baseline(*effects: str | ActiveEffect, **settings: float) -> WatchedPool:
    """Return a pool of a short recording with the fit of the law alone."""
    pool = make_pool(*effects, **settings)
    pool.fit_law()
    return pool.copy()
