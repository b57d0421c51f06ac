"""From recordings to the pieces that a fit or a prediction works on: smooth motion, known delays, masks."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatch
from typing import Any

import numpy as np
import orjson

from identification.arrays import BoolArray
from identification.drive import steady_levels
from identification.errors import NothingToFit
from identification.force_channel import LowPass, filter_lag
from identification.gap.floor import Floor, combine_floors, measure_floor
from identification.motion import estimate_motion
from identification.piece import Piece
from identification.recordings import Recording, Stretch
from identification.simulate import Stroke

_SKIPPED = 0.02
"""[s] at the start of a stretch, while the hysteretic state that nobody recorded is forgotten."""

_MOST_LOST = 0.5
"""[1] part of a stretch that may be left out since the rod stumbled."""
_FILTER_RATE = 4000.0
"""[Hz] at which the force is simulated in front of a filter."""
_TIMED = {"force", "displacement", "coil_voltage", "coil_current"}
"""Channels between which a delay matters."""
_MAPPED = 20e-6
"""[s] what remains between two device clocks that were mapped onto the bench clock."""


@dataclass(frozen=True)
class HoldOut:
    """Which samples are kept out of the fit."""

    patterns: tuple[str, ...] = ()
    """Names of stretches or segments, with wildcards."""
    after: float | None = None
    """[1] fraction of each stretch after which it is held out."""

    def mask(self, stretch: Stretch) -> BoolArray:
        """(N,) True where a stretch is held out."""
        count = len(stretch.time)
        held = np.zeros(count, bool)
        if self._names(stretch.name):
            held[:] = True
        for segment in stretch.segments:
            if self._names(segment.name):
                held[segment.start : segment.stop] = True
        if self.after is not None:
            held[round(self.after * count) :] = True
        return held

    def _names(self, name: str) -> bool:
        return any(fnmatch(name, pattern) for pattern in self.patterns)


@dataclass(frozen=True)
class Assembled:
    """All stretches of some recordings, ready to be simulated."""

    pieces: tuple[Piece, ...]
    """``train`` marks what is fitted."""
    held_out: tuple[BoolArray, ...]
    """(N,) of each piece."""
    stretches: tuple[Stretch, ...]
    floor: Floor
    recordings: tuple[Recording, ...]
    notes: tuple[str, ...] = ()
    """What was left out since the rod stumbled, in words."""

    @property
    def drive_unit(self) -> str:
        """V or A."""
        return self.recordings[0].drive_unit

    @property
    def delay_prior(self) -> float:
        """[s] how well the channels' clocks are known against each other."""
        return max(_clock_spread(r) for r in self.recordings)

    @property
    def clock_skew(self) -> float:
        """[s] the same as far as the logs say it of clocks that they have followed; 0 where they say nothing."""
        return max(_largest_skew(_clocks(r)) for r in self.recordings)


def _clock_spread(recording: Recording) -> float:
    """Standard deviation [s] of a channel delay: as mapped on a bench, else half the shortest sample."""
    if recording.metadata["run"].get("source") == "run":
        return max(_MAPPED, _largest_skew(_clocks(recording)))
    # An import says nothing of its clocks.
    return 0.5 / max(s.rate for s in recording.stretches)


def _clocks(recording: Recording) -> Mapping[str, str]:
    """What the log says of its clocks, at its end if it has one: by then they are known best."""
    metadata = recording.metadata
    return metadata.get("clock_skew") or metadata.get("clocks", {})


def _largest_skew(clocks: Mapping[str, str]) -> float:
    """Standard deviation [s] of the delay between force and the other channels, as the log's clocks say.

    Each says within how much it was mapped, in 95 of 100 samples; two of them stand between two channels.
    """
    known = [_facts(words) for words in clocks.values()]
    left = sorted(facts.get("skew_s") or 0.0 for facts in known if _TIMED & set(facts.get("channels", ())))
    return float(np.hypot(left[-2], left[-1])) / 2 if len(left) > 1 else 0.0


def _facts(words: str) -> dict[str, Any]:
    """What a log says of one clock; nothing where it says it in words for a person."""
    try:
        facts = orjson.loads(words)
    except orjson.JSONDecodeError:
        return {}
    return facts if isinstance(facts, dict) else {}


def assemble(recordings: Sequence[Recording], hold_out: HoldOut = HoldOut()) -> Assembled:
    """Smooth the motion of every stretch and mark what is fitted.

    Raises:
        NothingToFit: the logs are driven in different ways, or a pattern holds nothing or everything out.
    """
    kinds = {r.drive_kind for r in recordings}
    if len(kinds) > 1:
        raise NothingToFit(f"the logs are driven in different ways ({', '.join(sorted(kinds))}); fit them apart")
    stretches = [s for r in recordings for s in r.stretches]
    held = [hold_out.mask(s) for s in stretches]
    starts = [s.time[0] - r.stretches[0].time[0] for r in recordings for s in r.stretches]
    logs = [k for k, r in enumerate(recordings) for _ in r.stretches]
    pieces, floors, notes = [], [], list[str]()
    for k, (out, start, log) in enumerate(zip(held, starts, logs, strict=True)):
        motion = estimate_motion(stretches[k])
        stretch = stretches[k] = _without_lost(stretches[k], motion.lost, notes)
        floors.append(measure_floor(replace(stretch, measured=stretch.counts), motion))
        fitted = stretch.counts & ~out
        fitted[: round(_SKIPPED * stretch.rate)] = False
        power = np.abs(stretch.force * motion.velocity)
        stroke = Stroke(stretch.rate, *motion[:3], steady_levels(stretch.drive), start=float(start), power=power)
        pieces.append(replace(_piece(stretch, stroke, fitted), log=log))
    _check(hold_out, held, pieces)
    floor = combine_floors(stretches, floors)
    return Assembled(tuple(pieces), tuple(held), tuple(stretches), floor, tuple(recordings), tuple(notes))


def _without_lost(stretch: Stretch, lost: BoolArray, notes: list[str]) -> Stretch:
    """The stretch without the force where nobody knows how the rod moved, all of it if that is most; says so."""
    if not lost.any():
        return stretch
    said = (
        f"{stretch.name}: the rod left its stroke (late setpoints, or a knock) in {lost.mean():.2%} of the samples"
    )
    if lost.mean() > _MOST_LOST:
        notes.append(f"{said}; the recording itself is bad: record again")
        return stretch
    notes.append(f"{said}; they are left out")
    return replace(stretch, force_valid=~lost if stretch.force_valid is None else stretch.force_valid & ~lost)


def _piece(stretch: Stretch, stroke: Stroke, fitted: BoolArray) -> Piece:
    # Strokes are slow: the displacement's filter counts as a delay. The force's is simulated (decision 0004).
    displacement_lag = stretch.displacement_delay + filter_lag(stretch.displacement_filter)
    return Piece(
        name=stretch.name,
        stroke=stroke,
        force=stretch.force,
        train=fitted.astype(np.float64),
        force_delay=stretch.force_delay - displacement_lag,
        drive_delay=displacement_lag - stretch.drive_delay,
        low_pass=_low_pass(stretch),
    )


def _low_pass(stretch: Stretch) -> LowPass | None:
    """The force channel's filter, on a grid fine enough for a force that turns within a millisecond."""
    if stretch.force_filter is None:
        return None
    return LowPass(stretch.force_filter, stretch.rate, max(1, round(_FILTER_RATE / stretch.rate)))


def _check(hold_out: HoldOut, held: Sequence[BoolArray], pieces: Sequence[Piece]) -> None:
    if hold_out.patterns and not any(m.any() for m in held):
        raise NothingToFit(
            f"--hold-out {','.join(hold_out.patterns)} names no stretch and no segment of these logs"
        )
    if sum(p.train.sum() for p in pieces) < 200:
        raise NothingToFit("fewer than 200 samples are left to fit; hold less out")
