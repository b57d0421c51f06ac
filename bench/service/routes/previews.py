"""Route that previews a method: motion and drive over time, before anything moves."""

from functools import cache
from itertools import pairwise

import numpy as np
from fastapi import APIRouter

from bench.methods import Programme, compile_method
from bench.service.routes.methods import load_shipped_method
from bench.service.views import MethodPreview, PreviewSegment, PreviewSeries

router = APIRouter(prefix="/methods", tags=["methods"])
_BINS = 600
"""Number of intervals of a preview; of each, the lowest and the highest value are kept."""


@router.get("/{name}/preview")
def preview_method(name: str) -> MethodPreview:
    """Return motion and drive of a method as they will be commanded, reduced for a plot without losing a peak."""
    load_shipped_method(name)
    return _make_preview(name)


@cache
def _make_preview(name: str) -> MethodPreview:
    programme = compile_method(load_shipped_method(name))
    rate = programme.rate
    return MethodPreview(
        name=name,
        duration_s=programme.duration,
        drive_unit=programme.method.drive_unit,
        displacement_m=_reduce(programme, programme.displacement),
        drive=_reduce(programme, programme.drive),
        segments=tuple(
            PreviewSegment(
                name=one.name, start_s=one.start / rate, end_s=one.stop / rate, checkpoint=one.checkpoint
            )
            for one in programme.segments
        ),
    )


def _reduce(programme: Programme, values: np.ndarray[tuple[int], np.dtype[np.float64]]) -> PreviewSeries:
    """Keep the first sample, the last one, and the lowest and the highest of each interval, in order."""
    last = len(values) - 1
    edges = np.linspace(0, last + 1, min(_BINS, last + 1) + 1).astype(int)
    kept = {0, last}
    for first, end in pairwise(edges):
        part = values[first:end]
        kept |= {first + int(part.argmin()), first + int(part.argmax())}
    rows = sorted(kept)
    return PreviewSeries(
        time_s=[round(float(programme.time[row]), 6) for row in rows], values=[float(values[row]) for row in rows]
    )
