"""Preview of a method: motion and drive over time, before anything moves."""

from functools import lru_cache
from itertools import pairwise
from typing import Annotated

import numpy as np
from fastapi import APIRouter, Query

from bench.methods import Method, Programme, compile_method
from bench.service.context import Context
from bench.service.routes.planning.method_library import find_method
from bench.service.routes.planning.views import MethodPreview, PreviewSegment, PreviewSeries

router = APIRouter(prefix="/methods", tags=["methods"])
_BINS = 600
"""Number of intervals of a preview; of each, the lowest and the highest value are kept."""
_CACHED = 50
"""Number of previews that are kept."""


@router.get("/{name}/preview")
def preview_method(
    name: str,
    context: Context,
    version: Annotated[int | None, Query(ge=1, description="by default the newest version")] = None,
) -> MethodPreview:
    """Return motion and drive of a method as they will be commanded, reduced for a plot without losing a peak."""
    return _preview_document(find_method(context, name, version).method.to_json())


@lru_cache(_CACHED)
def _preview_document(document: str) -> MethodPreview:
    return make_preview(compile_method(Method.model_validate_json(document)))


def make_preview(programme: Programme) -> MethodPreview:
    """Return the preview of a compiled method."""
    rate = programme.rate
    return MethodPreview(
        name=programme.method.name,
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
