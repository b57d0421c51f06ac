"""REST routes of what a run has recorded and what persons add to it."""

from bench.service.routes.recordings import events, files, notes, samples, trash

ROUTERS = (samples.router, events.router, files.router, notes.router, trash.router)

__all__ = ["ROUTERS"]
