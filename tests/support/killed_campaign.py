"""A campaign whose process is killed at random moments, and what must be true afterwards.

``python -m tests.support.killed_campaign FOLDER KILLS SEED`` repeats it as often as wanted, for the evidence.
"""

import random
import subprocess
import sys
import time
from pathlib import Path

from bench.campaigns import CampaignRunner, CampaignStore, PlantBench, collect_methods, parse_campaign
from bench.catalogue import Catalogue, locate_catalogue, open_database
from bench.log import read_log

RIG = (sys.executable, str(Path(__file__).with_name("fast_rig.py")))
LONGEST_WAIT = 3.0
"""[s] Latest moment of a kill after the start of the process."""
METHOD = {
    "schema": "mrbench.method/1", "name": "short", "title": "Two short strokes", "description": "For kills.",
    "rate_hz": 500, "drive_kind": "coil_v",
    "limits": {"stroke_m": 0.02, "velocity_mps": 0.3, "acceleration_mps2": 6.0, "force_n": 1500.0, "drive": 0.5},
    "segments": [
        {"name": name, "checkpoint": True, "motion": {"kind": "sine", "amplitude_m": 0.01, "frequency_hz": 1},
         "cycles": 2, "drive": {"kind": "constant", "value": 0.2}}
        for name in ("first", "second")
    ],
}  # fmt: skip
STEPS = {"matrix": {"specimens": ["A", "B", "C"], "methods": [METHOD], "repeats": 4,
                    "before_run": [{"rest": {"seconds": 60}}]}}  # fmt: skip


def open_store(folder):
    return CampaignStore(Catalogue(open_database(locate_catalogue(folder)), folder))


def execute(folder):
    """Start the campaign of a folder, or continue it."""
    store = open_store(folder)
    document = parse_campaign({"name": "kills", "steps": STEPS}, "the test")
    methods = collect_methods(document)
    found = store.find_unfinished(document, methods, "double") or store.create(document, methods, "double", 1e9)
    CampaignRunner(store, found.id, PlantBench(store.catalogue, "double", found.state.updated, rig=RIG)).run()
    store.catalogue.close()


def kill_at_random(folder, kills, seed):
    """Run a campaign to its end, with some kills; return the number of kills."""
    moments, done = random.Random(seed), 0
    while True:
        process = subprocess.Popen([sys.executable, "-m", "tests.support.killed_campaign", str(folder)])
        try:
            process.wait(moments.uniform(0.6, LONGEST_WAIT) if done < kills else 240)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            done += 1
            continue
        assert process.returncode == 0
        return done


def check(folder):
    """Check that every step ended once, by a complete log of its own; return the number of steps held back."""
    store = open_store(folder)
    state = store.list_campaigns(1)[0].state
    assert state.status == "done"
    runs = [run for item in state.items for run in item.runs]
    assert len(runs) == len(set(runs))
    assert {fact.run for fact in state.facts} == set(runs)
    for item in state.items:
        assert item.state in ("done", "held_back")
        is_run = hasattr(item.step, "run")
        assert len(item.runs) == (1 if is_run and item.state == "done" else 0)
    for run in runs:
        row = store.catalogue.get_run(run)
        assert row.outcome == "clean"
        assert read_log(folder / row.log).outcome == "clean"
    for item in state.items:
        assert all(store.catalogue.get_run(part).outcome == "incomplete" for part in item.parts)
    store.catalogue.close()
    return sum(item.state == "held_back" for item in state.items)


def main():
    folder = Path(sys.argv[1])
    if len(sys.argv) == 2:
        return execute(folder)
    kills, seed = int(sys.argv[2]), int(sys.argv[3])
    began, total, campaigns, held = time.monotonic(), 0, 0, 0
    while total < kills:
        place = folder / f"campaign-{campaigns}"
        place.mkdir(parents=True)
        total += kill_at_random(place, min(kills - total, 20), seed + campaigns)
        held += check(place)
        campaigns += 1
    print(f"{total} kills, {campaigns} campaigns, {held} steps held back, {time.monotonic() - began:.0f} s")
    return None


if __name__ == "__main__":
    main()
