"""Dry run of a stored or an inline method: peaks, heat, limits of this bench, disk, and what is identifiable."""

import threading
from functools import lru_cache
from pathlib import Path
from typing import Any

from fastapi import APIRouter

from bench.agent_protocol import BenchDescription
from bench.disk import RESERVE, estimate_log_size, find_free_space
from bench.errors import AgentUnreachableError, RunError
from bench.methods import Envelope, Method, compile_method, compute_envelope, list_checkpoints, parse_method
from bench.runs import FORESEE_COMMAND, assess_design
from bench.service.context import Context, ServiceContext
from bench.service.routes.planning.method_library import find_method
from bench.service.routes.planning.methods import describe_drive_obstacle
from bench.service.routes.planning.previews import make_preview
from bench.service.routes.planning.views import BenchCheck, DryRun, DryRunRequest

router = APIRouter(prefix="/methods", tags=["methods"])
_CACHED = 50
"""Number of assessments that are kept."""
_MAX_SAMPLES = 2_000_000
"""Largest number of samples of a dry run, which limits its memory; half an hour at 1 kHz."""
_LOWEST_PRIORITY = ("nice", "-n", "19")
"""Command that leaves the processor to the rig agent."""
_assessing = threading.Lock()
"""Held during an assessment, so that there is one at a time, and an equal request waits for its result."""
_PEAKS = {"force": ("force_n", 1.0, "N"), "displacement": ("displacement_m", 1e3, "mm"),
          "actuator_velocity": ("velocity_mps", 1e3, "mm/s")}  # fmt: skip
"""Peak that each limit of the bench is compared with: its field, and factor and unit for people."""
_ACTIONS = ("hold", "controlled_stop", "trip")
"""Actions of the bench that end a motion."""


@router.post("/dry-run")
def dry_run(request: DryRunRequest, context: Context) -> DryRun:
    """Return the forecast of a run; nothing moves. What the strokes can identify is kept for each content."""
    method = _take_method(context, request)
    programme = compile_method(method, _MAX_SAMPLES)
    envelope = compute_envelope(programme)
    error = ""
    if request.identifiability:
        try:
            with _assessing:
                envelope = envelope.model_copy(update={"design": _assess(method.to_json())})
        except RunError as reason:  # for example a bench without the identification package
            error = str(reason)
    return DryRun(
        sha256=method.compute_sha256(),
        envelope=envelope,
        mean_heat_w=envelope.heat_j / programme.duration if programme.duration else 0.0,
        preview=make_preview(programme),
        checkpoints=list_checkpoints(programme),
        bench=_check_bench(context, request.bench, method, envelope),
        identifiability_error=error,
    )


def _take_method(context: ServiceContext, request: DryRunRequest) -> Method:
    if isinstance(request.method, str):
        return find_method(context, request.method, request.version).method
    return parse_method(request.method, "the request")


@lru_cache(_CACHED)
def _assess(document: str) -> dict[str, Any]:
    programme = compile_method(Method.model_validate_json(document), _MAX_SAMPLES)
    return assess_design(programme, command=(*_LOWEST_PRIORITY, *FORESEE_COMMAND))


def _check_bench(context: ServiceContext, name: str | None, method: Method, envelope: Envelope) -> BenchCheck:
    if name is None and context.benches.are_several:
        unknown = f"the service has several benches; name one of {', '.join(context.benches.names)}"
        return BenchCheck(limits={}, obstacles=(), unknown=unknown, log_bytes=None, free_bytes=None)
    served = context.benches.get(name)
    free = _find_free_bytes(context.data) if served.has_local_logs else None
    try:
        bench = served.monitor.describe_bench()
    except AgentUnreachableError as error:
        return BenchCheck(limits={}, obstacles=(), unknown=str(error), log_bytes=None, free_bytes=free)
    rates = (channel.rate_hz for name, channel in bench.channels.items() if name != "coil_drive")
    size = estimate_log_size(envelope.total.duration_s, rates)
    obstacles = [describe_drive_obstacle(method, bench.drive_kind), *_find_excesses(bench, envelope)]
    if free is not None and free < size + RESERVE:
        obstacles.append(f"the log needs up to {size / 1e9:.3f} GB, the disk has {free / 1e9:.3f} GB free")
    return BenchCheck(
        limits=bench.limits, obstacles=tuple(filter(None, obstacles)), unknown="", log_bytes=size, free_bytes=free
    )


def _find_excesses(bench: BenchDescription, envelope: Envelope) -> list[str]:
    """Return a sentence for each peak beyond a limit of the bench that ends a motion."""
    found = []
    for name, (field, factor, unit) in _PEAKS.items():
        peak, limit = getattr(envelope.total, field), bench.limits.get(name)
        values = [] if limit is None else [value for action in _ACTIONS if (value := getattr(limit, action))]
        if values and peak > min(values):
            words = name.replace("_", " ")
            found.append(
                f"{words} {peak * factor:.4g} {unit} exceeds the bench's {min(values) * factor:.4g} {unit}"
            )
    return found


def _find_free_bytes(folder: Path) -> int | None:
    try:
        return find_free_space(folder).free
    except RunError:
        return None
