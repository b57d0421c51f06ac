"""Benches of a service: what belongs to each of them alone."""

from bench.service.benches.bench_maker import BenchMaker
from bench.service.benches.served_bench import BenchSettings, ServedBench
from bench.service.benches.served_benches import ServedBenches

__all__ = [
    "BenchMaker",
    "BenchSettings",
    "ServedBench",
    "ServedBenches",
]
