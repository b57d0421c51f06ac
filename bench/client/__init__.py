"""Client of the service for scripts and notebooks: ``Bench(url, token).run(id).arrays()``."""

from bench.client.arrays import Arrays
from bench.client.bench import Bench
from bench.client.campaign import Campaign
from bench.client.errors import ClientError
from bench.client.job import Job
from bench.client.live import LiveSamples
from bench.client.run import Run
from bench.client.states import JobState, RunState

__all__ = [
    "Arrays",
    "Bench",
    "Campaign",
    "ClientError",
    "Job",
    "JobState",
    "LiveSamples",
    "Run",
    "RunState",
]
