"""Route of the metrics for Prometheus: bench, instruments, jobs, disk, listeners, and requests."""

import asyncio
from collections.abc import Iterator
from typing import cast

from fastapi import APIRouter, Request, Response
from prometheus_client import CONTENT_TYPE_LATEST, CollectorRegistry, Metric, generate_latest
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily
from prometheus_client.registry import Collector

from bench.agent_protocol import AgentStatus, InstrumentStatus
from bench.disk import find_free_space
from bench.errors import RunError
from bench.log_store import CopyCounts
from bench.service.benches import ServedBenches
from bench.service.context import Context, ServiceContext

router = APIRouter(tags=["service"])


@router.get("/metrics", response_class=Response)
async def get_metrics(request: Request, context: Context) -> Response:
    """Return the metrics in the text format of Prometheus."""
    worker = await context.engine.describe_state()
    state = CollectorRegistry(auto_describe=False)
    state.register(ServiceCollector(context, has_worker=worker == "ok"))
    requests = cast(CollectorRegistry, request.app.state.request_metrics)
    text = await asyncio.to_thread(lambda: generate_latest(state) + generate_latest(requests))
    return Response(text, media_type=CONTENT_TYPE_LATEST)


class ServiceCollector(Collector):
    """Metrics of the present state, read when they are collected."""

    def __init__(self, context: ServiceContext, *, has_worker: bool) -> None:
        self._context, self._has_worker = context, has_worker

    def collect(self) -> Iterator[Metric]:
        """Yield the metrics; those of instruments only while their agent is known."""
        context = self._context
        yield from _collect_benches(context.benches)
        yield _make_gauge("mrbench_worker_up", "1 if a worker is connected", self._has_worker)
        yield from _collect_disk(context)
        yield _make_counts("mrbench_jobs", "Jobs by state", context.catalogue.job_queue.count_states())
        yield _make_counts("mrbench_runs", "Runs by state", context.catalogue.count_runs())
        if context.log_copier is not None:
            yield from _collect_copies(context.log_copier.count())


def _collect_disk(context: ServiceContext) -> Iterator[Metric]:
    try:
        free = find_free_space(context.data).free
    except RunError:  # without a value the metric is absent, which an alert can test
        return
    yield _make_gauge("mrbench_disk_free_bytes", "Free space of the data folder's disk", free)


def _collect_copies(counts: CopyCounts) -> Iterator[Metric]:
    yield _make_gauge("mrbench_log_store_up", "0 if the log store did not answer", counts.is_reachable)
    yield _make_gauge("mrbench_logs_waiting", "Logs without a verified copy in the log store", counts.waiting)
    copied, failed = "Logs copied since the start of the service", "Failed copies since the start of the service"
    yield CounterMetricFamily("mrbench_logs_copied", copied, value=counts.copied)
    yield CounterMetricFamily("mrbench_log_copies_failed", failed, value=counts.failed)


def _collect_benches(benches: ServedBenches) -> Iterator[Metric]:
    """Yield the metrics of all benches; with several benches each value has the label `bench`."""
    names = ["bench"] if benches.are_several else []
    labels = {bench.name: [bench.name] if names else [] for bench in benches}
    statuses = benches.find_statuses()
    up = GaugeMetricFamily("mrbench_agent_up", "1 if the status of the rig agent is known", labels=names)
    listeners = GaugeMetricFamily("mrbench_live_listeners", "Websocket clients of live data", labels=names)
    for bench in benches:
        up.add_metric(labels[bench.name], float(statuses[bench.name] is not None))
        listeners.add_metric(labels[bench.name], float(bench.live.count))
    known = [(labels[name], status) for name, status in statuses.items() if status is not None]
    yield from (up, listeners)
    if known:
        yield from _collect_known(names, known)


def _collect_known(names: list[str], known: list[tuple[list[str], AgentStatus]]) -> Iterator[Metric]:
    """Yield the metrics of the statuses that are known, each with its labels."""
    present, stamp = "1 for the present state of the bench", "UTC at which the agent made its status"
    state = GaugeMetricFamily("mrbench_bench_state", present, labels=[*names, "state"])
    made = GaugeMetricFamily("mrbench_status_timestamp_seconds", stamp, labels=names)
    for labels, status in known:
        state.add_metric([*labels, status.state], 1)
        made.add_metric(labels, status.utc_s)
    yield from (state, made)
    for name, text, field in _INSTRUMENT_GAUGES:
        yield _add_instruments(GaugeMetricFamily(name, text, labels=[*names, "instrument"]), known, field)
    for name, text, field in _INSTRUMENT_COUNTERS:
        yield _add_instruments(CounterMetricFamily(name, text, labels=[*names, "instrument"]), known, field)


_INSTRUMENT_GAUGES = (
    ("mrbench_instrument_connected", "1 if the instrument answers", "connected"),
    ("mrbench_instrument_age_seconds", "Time since the last valid frame", "age_s"),
    ("mrbench_clock_error_bound_seconds", "95 % bound of the error of the clock", "clock_error_bound_s"),
)
_INSTRUMENT_COUNTERS = (
    ("mrbench_frames_received", "Frames or replies received since the start of the agent", "received"),
    ("mrbench_samples_lost", "Samples that were taken and never received", "lost"),
    ("mrbench_frames_corrupted", "Discarded frames", "corrupted"),
    ("mrbench_resynchronisations", "Searches for the start of a frame", "resynchronised"),
)
"""Name, explanation, and field of `InstrumentStatus`."""


def _add_instruments(
    family: GaugeMetricFamily | CounterMetricFamily, known: list[tuple[list[str], AgentStatus]], field: str
) -> GaugeMetricFamily | CounterMetricFamily:
    for labels, status in known:
        for one in status.instruments:
            value = _read(one, field)
            if value is not None:
                family.add_metric([*labels, one.name], value)
    return family


def _read(instrument: InstrumentStatus, field: str) -> float | None:
    value = getattr(instrument, field)
    return None if value is None else float(value)


def _make_gauge(name: str, text: str, value: float) -> Metric:
    return GaugeMetricFamily(name, text, value=float(value))


def _make_counts(name: str, text: str, counts: dict[str, int]) -> Metric:
    family = GaugeMetricFamily(name, text, labels=["state"])
    for state, count in sorted(counts.items()):
        family.add_metric([state], count)
    return family
