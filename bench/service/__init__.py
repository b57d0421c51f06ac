"""The service: REST, live values and the page, in front of the rig agent, the catalogue and the jobs."""

from bench.service.serving import ServeOptions, serve

__all__ = [
    "ServeOptions",
    "serve",
]
