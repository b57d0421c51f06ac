"""REST routes of what a run has recorded and what persons add to it."""

from bench.service.routes.recordings import events, files, notes, replay, samples, trash
from bench.service.routes.recordings.samples import load_samples

ROUTERS = (samples.router, events.router, files.router, notes.router, replay.router, trash.router)

__all__ = ["ROUTERS", "load_samples"]
