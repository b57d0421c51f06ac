"""A campaign of a whole bench whose processes are killed while a person edits it by REST, and what must hold then.

``python -m tests.support.killed_bench_campaign FOLDER KILLS SEED`` repeats it as often as wanted, for the
evidence. Simulated rig, agent, worker, service or all of them are killed by SIGKILL at random moments. Rig and
service are started again. The person works in a thread of its own, so that kills meet its commands too: it edits,
resets trips and answers.
"""

import random
import threading
import time
from collections import Counter
from dataclasses import dataclass, field

from bench.audit import AUDIT_FILE, list_newest, verify_chain
from bench.client import ClientError
from bench.commands.campaign.catalogue import open_store
from tests.support.bench_processes import PARTS, BenchProcesses
from tests.support.campaign_author import CampaignAuthor, Look, name_command
from tests.support.killed_bench import VICTIMS, await_ready, handle_trip, restart
from tests.support.killed_campaign import check_runs
from tests.support.live_bench import method
from tests.support.tally import Tally, repeat

LATEST_KILL = 12.0
"""Latest moment of a kill after the recovery from the one before [s]: a step takes about eight seconds."""
PAUSE = 0.7
"""Time between two looks of the person [s]."""
KILLS_OF_ONE_CAMPAIGN = 20
LONGEST = 600.0
"""Longest time of a campaign after its last kill [s]."""


def make_document(repeats):
    """Return a campaign of three specimens, with a rest before each run."""
    matrix = {"specimens": ["A", "B", "C"], "methods": [method()], "repeats": repeats}
    steps = {"matrix": {**matrix, "before_run": [{"rest": {"seconds": 2}}]}}
    return {"schema": "mrbench.campaign/1", "name": "kills", "steps": steps}


class RestAuthor(CampaignAuthor):
    """A person who uses the REST interface of a bench whose service may be killed at any time."""

    def __init__(self, bench, campaign, draw):
        super().__init__(method(), draw)
        self.bench, self.id = bench, campaign
        self.has_ended = False
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._work)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *error):
        self._stopping.set()
        self._thread.join()

    def _work(self):
        while not self._stopping.wait(PAUSE):
            self._free_bench()
            self.act()

    def _free_bench(self):
        """Reset a trip, and end an agent whose rig is another one now."""
        status = self.bench.get("/bench")
        if status is not None and status["state"] == "tripped":
            handle_trip(self.bench, status)

    def look(self):
        state = self.bench.get(f"/campaigns/{self.id}")
        if state is None:
            return None
        self.has_ended = state["status"] in ("done", "stopped")
        return Look(
            status=state["status"], has_ended=self.has_ended, needs_person=state["question"] is not None,
            is_question=bool(state["question"] and state["question"]["choices"]),
            pending=[item["id"] for item in state["items"] if item["state"] == "pending"],
            held=[item["id"] for item in state["items"] if item["state"] == "held_back"],
        )  # fmt: skip

    def command(self, action, *, note=None, choice=None, edit=None):
        campaign = self.bench.client.campaign(self.id)
        try:
            if edit is not None:
                campaign.edit(edit, "author")
            elif choice or note:
                campaign.answer(note or "", "author", choice)
            else:
                {"pause": campaign.pause, "resume": campaign.resume}[action]("author")
        except ClientError as error:
            self.counts["refused" if error.status is not None else "unanswered"] += 1
        else:
            self.counts["accepted"] += 1
            self.counts[name_command(action, note, choice, edit)] += 1


@dataclass
class Result(Tally):
    """Kills, commands, ends of steps and runs of one or several campaigns."""

    kills: Counter = field(default_factory=Counter)
    commands: Counter = field(default_factory=Counter)
    steps: Counter = field(default_factory=Counter)
    runs: Counter = field(default_factory=Counter)
    unattributed: int = 0
    """Number of runs that belong to no step."""
    entries: int = 0
    """Number of entries of accepted commands in the audit trails."""


def kill_campaign(folder, kills, seed, repeats=4):
    """Run a campaign on a bench in a folder, kill parts at random moments, and return the result."""
    bench, draw, result = BenchProcesses(folder), random.Random(seed), Result()
    try:
        bench.start_rig()
        bench.start_service()
        await_ready(bench)
        campaign = bench.client.start_campaign(make_document(repeats), "author")
        with RestAuthor(bench, campaign.id, random.Random(seed + 1)) as author:
            while result.kills.total() < kills and not _wait(author, draw.uniform(0.5, LATEST_KILL)):
                victim = draw.choice(VICTIMS)
                killed = [bench.kill(name) for name in (PARTS if victim == "all" else (victim,))]
                result.kills[victim] += any(killed)
                restart(bench)
            assert _wait(author, LONGEST), f"does not end: {bench.get(f'/campaigns/{campaign.id}')}"
        result.commands = author.counts
    finally:
        bench.end()
    check_campaign(bench.data, result)
    return result


def _wait(author, seconds):
    """Wait for a time, or for the end of the campaign; return whether it has ended."""
    end = time.monotonic() + seconds
    while time.monotonic() < end and not author.has_ended:
        time.sleep(0.1)
    return author.has_ended


def check_campaign(data, result):
    """Check runs, logs and audit trail of an ended campaign, and add steps, runs and entries to the result."""
    with open_store(data) as store:
        state = check_runs(store, data)
        result.steps.update(item.state for item in state.items)
        rows = store.catalogue.list_runs(1000)
        result.runs.update(row.outcome or row.state for row in rows)
        attributed = {run for item in state.items for run in (*item.runs, *item.parts)}
        result.unattributed = sum(row.id not in attributed for row in rows)
    assert not verify_chain(data / AUDIT_FILE).fault
    paths = ("POST /campaigns/{campaign_id}/", "PATCH /campaigns/{campaign_id}")
    entries = [one for one in list_newest(data / AUDIT_FILE, 100_000) if one.action.startswith(paths)]
    result.entries = sum(one.outcome.startswith("2") for one in entries)
    # A command without an answer may have been recorded before the service was killed.
    accepted, unanswered = result.commands["accepted"], result.commands["unanswered"]
    assert accepted <= result.entries <= accepted + unanswered


if __name__ == "__main__":
    repeat(kill_campaign, Result(), KILLS_OF_ONE_CAMPAIGN)
