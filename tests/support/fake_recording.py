"""Routes of a recorded run of the fake service: samples, segments, events and raw frames."""

import json
from typing import Any

import numpy as np
from fastapi import APIRouter, Request, Response

from bench.samples import encode_batches

RATE = 1000
SECONDS = 24.0
STARTED = 1_741_079_490.0
CHANNELS = {"displacement": "m", "velocity": "m/s", "force": "N", "coil_drive": "V"}
SEGMENTS = [
    {"index": 0, "name": "10mm_1Hz_0V", "stretch": "quick", "start_s": 1.0, "stop_s": 9.0},
    {"index": 1, "name": "10mm_1Hz_0.2V", "stretch": "quick", "start_s": 12.0, "stop_s": 22.0},
]
EVENTS = [
    {"id": 1, "at": "2025-03-04T09:11:41Z", "time_s": 11.0, "kind": "checkpoint", "text": "after 10mm_1Hz_0V"},
    {"id": 2, "at": "2025-03-04T09:11:45Z", "time_s": 15.0, "kind": "alarm", "text": "temperature 61 °C"},
]
"""Events without the run and the bench."""
FRAMES = "The raw frames of 5 instruments were decoded again: all 120 readings are equal."


def recording_routes() -> APIRouter:
    """Create the routes of the recording; every run has the same."""
    router = APIRouter(prefix="/runs")

    @router.get("/{run_id}/segments")
    async def segments(run_id: str) -> Any:
        return {"drive_unit": "V", "items": SEGMENTS}

    @router.get("/{run_id}/events")
    async def events(run_id: str) -> Any:
        return {"items": [one | {"run": run_id, "bench": "bench"} for one in EVENTS], "next": None}

    @router.post("/{run_id}/replay")
    async def replay(run_id: str) -> Any:
        return {"equal": True, "instruments": [], "text": FRAMES}

    @router.get("/{run_id}/samples")
    async def samples(run_id: str, request: Request) -> Any:
        query = request.query_params
        if query.get("format") != "float32":
            return {"time": [0.0, SECONDS], "started_utc_s": STARTED}
        time = np.arange(round(SECONDS * RATE) + 1) / RATE
        time = time[(time >= float(query["from"])) & (time <= float(query["to"]))]
        channels = [{"name": name, "unit": unit} for name, unit in {"time": "s", **CHANNELS}.items()]
        headers = {"X-Mrbench-Channels": json.dumps(channels)}
        content = b"".join(encode_batches(time, make_columns(time), STARTED))
        return Response(content, media_type="application/octet-stream", headers=headers)

    return router


def make_columns(time: Any) -> list[Any]:
    """Return a stroke of 5 mm in the first segment and of 10 mm afterwards, with a hysteresis loop."""
    omega = 2 * np.pi
    amplitude = np.where(time < 10.0, 0.005, 0.010)
    displacement, velocity = amplitude * np.sin(omega * time), amplitude * omega * np.cos(omega * time)
    drive = np.where(time < 10.0, 0.0, 0.2)
    force = (60 + 900 * drive) * np.tanh((velocity + 8 * displacement) / 0.02) + 900 * velocity
    return [displacement, velocity, force, drive]
