"""Choice of the samples of a log that are played: between two times, or in segments by name."""

import math
from dataclasses import dataclass
from fnmatch import fnmatchcase

import numpy as np

from bench.errors import LogError
from bench.log import Log


@dataclass(frozen=True)
class Selection:
    """Samples that are played: those that meet all conditions."""

    begin_s: float = 0.0
    """First time [s] since the first sample of the log."""
    end_s: float = math.inf
    """Last time [s] since the first sample of the log."""
    segment: str = ""
    """Pattern for names of segments or stretches, such as ``5mm_4Hz*``; empty for all samples."""

    def find_parts(self, log: Log) -> list[slice]:
        """Return the chosen samples of a log as parts in order of time.

        Raises:
            LogError: no sample is chosen.
        """
        time_s = log.samples["time"]
        first = int(np.searchsorted(time_s, self.begin_s))
        last = int(np.searchsorted(time_s, self.end_s, side="right"))
        clipped = [slice(max(part.start, first), min(part.stop, last)) for part in self._find_segments(log)]
        parts = [part for part in clipped if part.stop > part.start]
        if not parts:
            raise LogError(
                f"{log.path}: no sample from {self.begin_s:g} s to {self.end_s:g} s"
                + (f" in a segment {self.segment!r}" if self.segment else "")
                + f"; the log has {float(time_s[-1]):.1f} s and the segments {_list_names(log)}"
            )
        return parts

    def _find_segments(self, log: Log) -> list[slice]:
        if not self.segment:
            return [slice(0, len(log.samples["time"]))]
        return [
            slice(one.start, one.stop)
            for one in log.segments
            if fnmatchcase(one.name, self.segment) or fnmatchcase(one.stretch, self.segment)
        ]


def _list_names(log: Log) -> str:
    return ", ".join(dict.fromkeys(one.name for one in log.segments)) or "(none)"
