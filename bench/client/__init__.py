"""Client of the service for scripts and notebooks: ``Bench(url, token).run(id).arrays()``."""

from bench.client.arrays import Arrays
from bench.client.bench import Bench
from bench.client.campaign import Campaign
from bench.client.errors import ClientError
from bench.client.live import LiveSamples
from bench.client.run import Run, RunState

__all__ = [
    "Arrays",
    "Bench",
    "Campaign",
    "ClientError",
    "LiveSamples",
    "Run",
    "RunState",
]
