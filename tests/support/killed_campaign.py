"""A campaign that is edited and killed at random moments, and what must be true afterwards.

``python -m tests.support.killed_campaign FOLDER KILLS SEED`` repeats it as often as wanted, for the evidence.
Options: ``--clock`` lets the clock of the campaign step at each start, ``--copy`` continues from a copy of the
folder at a random moment instead of a kill, as after a loss of power.
"""

import argparse
import contextlib
import random
import shutil
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import psutil

from bench.campaigns import CampaignRunner, PlantBench, collect_methods, parse_campaign
from bench.commands.campaign.catalogue import open_store
from bench.log import read_log
from tests.support.campaign_author import CommandAuthor, check_audit

RIG = (sys.executable, str(Path(__file__).with_name("fast_rig.py")))
LONGEST_WAIT = 3.0
"""[s] Latest moment of a kill after the start of the process."""
LARGEST_STEP = 7200.0
"""[s] Largest step of the clock between two processes."""
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


def execute(folder, step=0.0):
    """Start the campaign of a folder, or continue it, with a step of its clock [s]."""
    document = parse_campaign({"name": "kills", "steps": STEPS}, "the test")
    methods = collect_methods(document)
    with open_store(folder, is_created=True) as store:
        found = store.find_unfinished(document, methods, "double") or store.create(
            document, methods, "double", time.time()
        )
        bench = PlantBench(store.catalogue, "double", found.state.updated + step, rig=RIG)
        CampaignRunner(store, found.id, bench).run()


class KilledCampaign:
    """A campaign in a folder, with a person who edits it and moments at which its processes are killed."""

    def __init__(self, folder, seed, *, clock=False, copy=False):
        self.folder, self.random = folder, random.Random(seed)
        self.author = CommandAuthor(folder, METHOD, self.random)
        self.clock, self.copy = clock, copy
        self.counts = Counter()

    def run(self, kills):
        """Run the campaign to its end, with some kills; return the number of kills."""
        done = 0
        while True:
            process = self._start()
            if self._wait(process, self.random.uniform(0.6, LONGEST_WAIT) if done < kills else 240.0):
                assert process.returncode == 0
                return done
            self._interrupt(process)
            done += 1

    def _start(self):
        step = self.random.uniform(-LARGEST_STEP, LARGEST_STEP) if self.clock else 0.0
        command = [
            sys.executable,
            "-m",
            "tests.support.killed_campaign",
            str(self.folder),
            "--step",
            f"{step:.1f}",
        ]
        return subprocess.Popen(command, start_new_session=True)

    def _wait(self, process, seconds):
        """Edit until the process ends or the time is over; return whether it has ended."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if process.poll() is not None:
                return True
            self.author.act()
            time.sleep(0.1)
        return process.poll() is not None

    def _interrupt(self, process):
        """Kill the campaign's process, its rig, or both; or continue from a copy of the folder."""
        kind = "copy" if self.copy else self.random.choice(("process", "rig", "all"))
        rigs = psutil.Process(process.pid).children(recursive=True)
        if kind == "copy":
            self._copy_folder(process, rigs)
        elif kind != "process":
            signal_all(rigs, psutil.Process.kill)
        if kind == "rig" and rigs:
            # The campaign has to notice it, before its own process is killed.
            self._wait(process, self.random.uniform(0.2, 1.0))
        process.kill()
        process.wait()
        self.counts[kind] += 1

    def _copy_folder(self, process, rigs):
        """Copy the folder at one moment, and put the copy in its place."""
        members = [psutil.Process(process.pid), *rigs]
        signal_all(members, psutil.Process.suspend)
        copy = self.folder.with_name(f"{self.folder.name}-copy")
        shutil.copytree(self.folder, copy)
        signal_all(members, psutil.Process.kill)
        process.wait()
        shutil.rmtree(self.folder)
        copy.rename(self.folder)


def signal_all(processes, send):
    """Send a signal to processes, some of which may just have ended by themselves."""
    for process in processes:
        with contextlib.suppress(psutil.NoSuchProcess):
            send(process)


def check(campaign):
    """Check that every step ended once, by a complete log of its own; return the number of steps held back.

    By the clock of the campaign, the steps end in the order of the queue, unless one was released late.
    """
    with open_store(campaign.folder) as store:
        return check_steps(store, campaign)


def check_steps(store, campaign):
    """Check the steps of a campaign in its catalogue; return the number of those held back."""
    state = check_runs(store, campaign.folder)
    ended = [item.ended for item in state.items if item.state == "done"]
    assert campaign.clock or campaign.author.counts["release"] or ended == sorted(ended)
    return sum(item.state == "held_back" for item in state.items)


def check_runs(store, folder):
    """Check that each step of an ended campaign has one complete run or none; return the campaign's state.

    No complete run was repeated, belongs to two steps, or belongs to none.
    """
    state = store.list_campaigns(1)[0].state
    assert state.status == "done"
    for item in state.items:
        assert item.state in ("done", "held_back", "skipped")
        is_run = hasattr(item.step, "run")
        assert len(item.runs) == (1 if is_run and item.state == "done" else 0)
    runs = [run for item in state.items for run in item.runs]
    parts = [run for item in state.items for run in item.parts]
    assert len({*runs, *parts}) == len(runs) + len(parts)
    assert {fact.run for fact in state.facts} == set(runs)
    rows = {row.id: row for row in store.catalogue.list_runs(1000)}
    assert {row.id for row in rows.values() if row.outcome == "clean"} == set(runs)
    assert all(read_log(folder / rows[run].log).outcome == "clean" for run in runs)
    assert all(rows[part].outcome == "incomplete" for part in parts)
    return state


def repeat(options):
    """Kill as often as wanted, at most 20 times in one campaign, and print what happened."""
    began, total, campaigns, held, counts = time.monotonic(), 0, 0, 0, Counter()
    while total < options.kills:
        place = options.folder / f"campaign-{campaigns}"
        place.mkdir(parents=True)
        killed = KilledCampaign(place, options.seed + campaigns, clock=options.clock, copy=options.copy)
        total += killed.run(min(options.kills - total, 20))
        held += check(killed)
        counts += killed.counts + killed.author.counts
        counts["audit entries"] += check_audit(place, killed.author)
        campaigns += 1
        print(
            f"{total} kills, {campaigns} campaigns, {held} held back, {time.monotonic() - began:.0f} s, {counts}",
            flush=True,
        )


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("kills", type=int, nargs="?")
    parser.add_argument("seed", type=int, nargs="?", default=0)
    parser.add_argument("--step", type=float, default=0.0, help="step of the clock [s]")
    parser.add_argument("--clock", action="store_true")
    parser.add_argument("--copy", action="store_true")
    options = parser.parse_args()
    if options.kills is None:
        execute(options.folder, options.step)
    else:
        repeat(options)


if __name__ == "__main__":
    main()
