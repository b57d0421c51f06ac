"""Live data in the page beside scripted agents: drawn frames, and age of the samples in view, without a rig.

python -m benchmarks scripted_page

Scripted agents publish the six channels of the page over the real sockets, so that this machine runs neither a rig
nor an agent. A bench of 1 kHz is shown alone and with twenty listeners, one of which never reads. One bench of
100 Hz is compared with ten of them in one service.
"""

import json
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.live.browser import MEASURE_PAGE, start_script
from benchmarks.live.page import READERS, SECONDS, listen, print_view
from benchmarks.speed.benches import serve_benches
from benchmarks.speed.rest_load import wait_until_ready

CASES = (
    ("one bench at 1 kHz, page alone", 1, 1000, 0),
    ("one bench at 1 kHz, twenty listeners, one stalled", 1, 1000, READERS),
    ("one bench at 100 Hz, page alone", 1, 100, 0),
    ("ten benches at 100 Hz, page alone", 10, 100, 0),
)
"""Title, number of benches, samples of each bench [1/s], clients that read beside the page."""


def run() -> None:
    """Print frames and ages of each case."""
    print(f"Live page beside scripted agents: {SECONDS:g} s in Chromium without a graphics processor")
    for title, count, rate, readers in CASES:
        print(f"  {title}")
        _measure(count, rate, readers)


def _measure(count: int, rate: int, readers: int) -> None:
    with TemporaryDirectory() as path:
        data = Path(path) / "runs"
        data.mkdir()
        with serve_benches(Path(path), data, count, rate) as client:
            wait_until_ready(client, ())
            token = client.headers["Authorization"].removeprefix("Bearer ")
            address = f"{str(client.base_url).split('api/v1')[0]}#token={token}"
            with listen(address, readers):
                script = start_script(MEASURE_PAGE, address, str(SECONDS), "Idle")
                output, _ = script.communicate(timeout=300)
        print_view(json.loads(output.removeprefix("ready\n")))
