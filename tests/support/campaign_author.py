"""A person who edits a campaign at random while it runs, by the functions of ``mrbench campaign``."""

import io
import json
from collections import Counter
from contextlib import redirect_stdout

from bench.audit import AUDIT_FILE, verify_chain
from bench.campaigns import CampaignError
from bench.commands.campaign.catalogue import open_store
from bench.commands.campaign.control import control
from bench.errors import BenchError

RATE = 0.6
"""[1] Part of the looks in which the person edits."""
MOST_ADDED = 6
"""Largest number of steps that are added, so that the campaign ends."""


class CampaignAuthor:
    """A person at the campaign of a folder."""

    def __init__(self, folder, method, random):
        self.folder, self.method, self.random = folder, method, random
        self.counts = Counter()
        self.added = 0
        self.commands = 0

    def act(self):
        """Look once: answer what is asked, end a pause, and now and then edit the queue."""
        state = self._read_state()
        if state is None or state.has_ended:
            return
        if state.needs_person:
            self._answer(state)
        elif state.status in ("paused", "pausing"):
            if self.random.random() < 0.5:
                self._command("resume")
        elif self.random.random() < RATE:
            self._edit(state)

    def _read_state(self):
        """Return the state of the campaign; None before it exists."""
        try:
            with open_store(self.folder) as store:
                found = store.list_campaigns(1)
        except BenchError:
            return None
        return found[0].state if found else None

    def _answer(self, state):
        if state.active.is_question:
            self._command("resume", choice="retry")
        else:
            self._command("resume", note="go on")

    def _edit(self, state):
        pending = [item.id for item in state.pending]
        kind = self.random.choice(("pause_now", "add", "move", "delete", "pause", "do_now", "release"))
        if kind == "pause_now":
            self._command("pause")
            return
        edit = self._make_edit(kind, state, pending)
        if edit is not None:
            self._command("edit", edit=json.dumps({"edit": kind, **edit}), kind=kind)

    def _make_edit(self, kind, state, pending):
        """Return the fields of an edit; None where the queue has nothing for it."""
        held = [item.id for item in state.items if item.state == "held_back"]
        if kind == "release" and held:
            return {"item": held[0]}
        if kind in ("add", "pause", "do_now"):
            if self.added >= MOST_ADDED:
                return None
            self.added += 1
            run = {"run": {"specimen": "D", "method": self.method}}
            return {
                "add": {"steps": [run]},
                "pause": {"before": self.random.choice([None, *pending])},
                "do_now": {"step": {"rest": {"seconds": 5}}},
            }[kind]
        if not pending or kind == "release":
            return None
        item = self.random.choice(pending)
        return (
            {"item": item, "position": self.random.randrange(len(pending))} if kind == "move" else {"item": item}
        )

    def _command(self, action, *, note=None, choice=None, edit="", kind=""):
        try:
            with redirect_stdout(io.StringIO()):
                control(action, "", self.folder, "author", note=note, choice=choice, edit=edit, as_json=True)
        except CampaignError:
            self.counts["refused"] += 1
        except BenchError as error:
            self.counts[f"failed: {error}"] += 1
        else:
            self.commands += 1
            self.counts[kind or ("answer" if choice or note else action)] += 1


def check_audit(folder, author):
    """Check that the audit trail is intact and has every command; return their number."""
    if not author.commands:
        assert not (folder / AUDIT_FILE).exists()
        return 0
    verification = verify_chain(folder / AUDIT_FILE)
    assert not verification.fault
    # The first entry begins the chain.
    assert verification.entries == author.commands + 1
    return author.commands
