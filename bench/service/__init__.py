"""Service: REST interface, live values and web page for the rig agent, the catalogue and the jobs."""

from bench.service.bench_agents import BenchPlace, parse_benches
from bench.service.serving import ServeOptions, TlsFiles, serve

__all__ = [
    "BenchPlace",
    "ServeOptions",
    "TlsFiles",
    "parse_benches",
    "serve",
]
