"""Dry run of a stored or an inline method: peaks, heat, limits of this bench, disk, and what is identifiable."""

from pathlib import Path

from fastapi import APIRouter

from bench.disk import RESERVE, estimate_log_size, find_free_space
from bench.errors import RunError
from bench.methods import Envelope, Method, compile_method, compute_envelope, list_checkpoints, parse_method
from bench.service.bench_check import compare_with_bench
from bench.service.context import Context, ServiceContext
from bench.service.routes.planning.assessments import MAX_SAMPLES, assess_programme
from bench.service.routes.planning.method_library import find_method
from bench.service.routes.planning.previews import make_preview
from bench.service.routes.planning.views import BenchCheck, DryRun, DryRunRequest

router = APIRouter(prefix="/methods", tags=["methods"])


@router.post("/dry-run")
def dry_run(request: DryRunRequest, context: Context) -> DryRun:
    """Return the forecast of a run; nothing moves. What the strokes can identify is kept for each content."""
    method = _take_method(context, request)
    programme = compile_method(method, MAX_SAMPLES)
    envelope = compute_envelope(programme)
    error = ""
    if request.identifiability:
        try:
            envelope = envelope.model_copy(update={"design": assess_programme(programme)})
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


def _check_bench(context: ServiceContext, name: str | None, method: Method, envelope: Envelope) -> BenchCheck:
    bench, unknown = context.benches.describe(name)
    served = context.benches.find(name)
    free = _find_free_bytes(context.data) if served is not None and served.has_local_logs else None
    if bench is None:
        return BenchCheck(limits={}, obstacles=(), unknown=unknown, log_bytes=None, free_bytes=free)
    rates = (channel.rate_hz for name, channel in bench.channels.items() if name != "coil_drive")
    size = estimate_log_size(envelope.total.duration_s, rates)
    compared = compare_with_bench(bench, method, envelope)
    obstacles = [*compared.obstacles, *compared.remarks]
    if free is not None and free < size + RESERVE:
        obstacles.append(f"the log needs up to {size / 1e9:.3f} GB, the disk has {free / 1e9:.3f} GB free")
    return BenchCheck(limits=bench.limits, obstacles=tuple(obstacles), unknown="", log_bytes=size, free_bytes=free)


def _find_free_bytes(folder: Path) -> int | None:
    try:
        return find_free_space(folder).free
    except RunError:
        return None
