"""Service: REST interface, live values and web page for the rig agent, the catalogue and the jobs."""

from bench.service.serving import ServeOptions, TlsFiles, serve

__all__ = [
    "ServeOptions",
    "TlsFiles",
    "serve",
]
