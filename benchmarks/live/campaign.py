"""Campaign of 24 runs on the simulated rig, unattended: three specimens, four methods, two repeats.

python -m benchmarks campaign

Before each run the damper rests until a temperature. One prompt, before the last specimen, is answered through
REST. The thermal model of the damper is small, so that it warms and cools in seconds instead of minutes.
`MRBENCH_CAMPAIGN` names a new folder that is kept.
"""

import json
import os
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from bench.client import Bench, Campaign
from bench.demo import DemoFolder, start_processes
from bench.log import read_log
from sim_rig.scenario import load_scenario

SPECIMENS, REPEATS = ("MR-0042", "MR-0043", "MR-0044"), 2
STROKES = {"slow": (0.012, 0.8), "middle": (0.01, 1.25), "fast": (0.008, 2.0), "short": (0.004, 3.0)}
"""Amplitude [m] and frequency [Hz] of the methods."""
SECONDS_PER_DRIVE, DRIVES = 2.5, (0.0, 0.2, 0.4, 0.1)
"""Time of each coil voltage [s], and the voltages [V]."""
WIRES = ("--load-cell", "tcp")
"""The bytes of a pseudo terminal wait for a thread of the kernel that has no real-time priority."""
CAPACITY, LOSS, REST_C, TIMEOUT = 40.0, 2.0, 24.0, 120
"""Heat capacity [J/K], heat loss [W/K], temperature that a rest waits for [°C], its time-out [s]."""


def run() -> None:
    """Run the campaign and print what became of its runs and steps."""
    with _choose_folder() as folder:
        scenario = folder / "scenario.json"
        thermal = {"capacity": CAPACITY, "loss": LOSS}
        plain = load_scenario("default").model_dump(mode="json", exclude_unset=True)
        scenario.write_text(json.dumps(plain | {"thermal": plain.get("thermal", {}) | thermal}), "utf-8")
        options = ("--scenario", str(scenario), *WIRES)
        with start_processes(DemoFolder(folder, "night", None, 1), options) as address:
            bench = Bench(address)
            campaign = bench.start_campaign(make_campaign(), "benchmark")
            answered = _answer_prompts(campaign)
            state = campaign.get_state()
            report = campaign.download_report(folder / "report.html")
            _print_result(bench, state, answered, folder)
            print(f"  report: {report.stat().st_size / 1e6:.2f} MB")


@contextmanager
def _choose_folder() -> Iterator[Path]:
    kept = os.environ.get("MRBENCH_CAMPAIGN")
    if kept:
        Path(kept).mkdir(parents=True)
        yield Path(kept)
        return
    with TemporaryDirectory() as folder:
        yield Path(folder)


def make_campaign() -> dict[str, Any]:
    """Return the document of the campaign."""
    rest = {"rest": {"until_temperature_c": REST_C, "timeout_s": TIMEOUT}}

    def make_steps(specimens: tuple[str, ...]) -> list[dict[str, Any]]:
        runs = [(one, make_method(name)) for one in specimens for name in STROKES for _ in range(REPEATS)]
        return [step for one, method in runs for step in (rest, {"run": {"specimen": one, "method": method}})]

    prompt = {"prompt": {"text": "Mount the last specimen and remove the fan", "note": True}}
    return {"name": "unattended", "steps": [*make_steps(SPECIMENS[:2]), prompt, *make_steps(SPECIMENS[2:])]}


def make_method(name: str) -> dict[str, Any]:
    """Return a method of sines at one stroke, with all voltages."""
    amplitude, frequency = STROKES[name]
    cycles = round(SECONDS_PER_DRIVE * frequency)
    segments = [
        {
            "name": f"{name}_{drive:g}V", "checkpoint": True, "cycles": cycles,
            "motion": {"kind": "sine", "amplitude_m": amplitude, "frequency_hz": frequency},
            "drive": {"kind": "constant", "value": drive},
        }
        for drive in DRIVES
    ]  # fmt: skip
    limits = {"stroke_m": 0.02, "velocity_mps": 0.4, "acceleration_mps2": 8.0, "force_n": 1500.0, "drive": 0.5}
    return {
        "schema": "mrbench.method/1", "name": name, "title": name, "description": "For the campaign.",
        "rate_hz": 1000, "drive_kind": "coil_v", "limits": limits, "segments": segments,
    }  # fmt: skip


def _answer_prompts(campaign: Campaign) -> int:
    """Answer each question until the campaign ends; return the number of answers."""
    answered = 0
    while (state := campaign.wait())["question"] is not None:
        if state["question"]["choices"]:
            raise RuntimeError(f"a step has failed: {state['question']['text']}")
        campaign.answer("torque 12 N m", who="benchmark")
        answered += 1
    return answered


def _print_result(bench: Bench, state: dict[str, Any], answered: int, folder: Path) -> None:
    steps = Counter((item["kind"], item["state"]) for item in state["items"])
    runs = [run for item in state["items"] for run in item["runs"]]
    logs = [read_log(bench.run(run).download_log(folder / f"{run}.mcap")) for run in runs]
    lost = [json.loads(log.metadata["outcome"]["lost"]) for log in logs]
    print(f"campaign: {state['status']} {state['reason']}".rstrip())
    print(f"  steps: {', '.join(f'{count} {kind} {how}' for (kind, how), count in sorted(steps.items()))}")
    print(f"  runs: {len(runs)}, of them different {len(set(runs))}, {dict(Counter(log.outcome for log in logs))}")
    print(
        f"  samples: {sum(len(log.samples['time']) for log in logs)}, lost: {list(filter(None, lost)) or 'none'}"
    )
    print(f"  answers through REST: {answered}; times [s]: {state['times']}")
    warm = [float(log.samples["temperature"].max()) for log in logs]
    cold = [float(log.samples["temperature"][0]) for log in logs]
    print(
        f"  temperature [°C]: at the start of the runs {min(cold):.2f} to {max(cold):.2f}, largest {max(warm):.2f}"
    )


if __name__ == "__main__":
    run()
