"""A person who edits a campaign at random while it runs, by the functions of ``mrbench campaign`` or otherwise."""

import io
import json
from collections import Counter
from contextlib import redirect_stdout
from dataclasses import dataclass

from bench.audit import AUDIT_FILE, verify_chain
from bench.campaigns import CampaignError
from bench.commands.campaign.catalogue import open_store
from bench.commands.campaign.control import control
from bench.errors import BenchError

RATE = 0.6
"""[1] Part of the looks in which the person edits."""
MOST_ADDED = 6
"""Largest number of steps that are added, so that the campaign ends."""


@dataclass(frozen=True)
class Look:
    """View of a campaign, as a person sees it."""

    status: str
    has_ended: bool
    needs_person: bool
    is_question: bool
    """True if a failure has to be decided on, false if a prompt is to be answered."""
    pending: list
    held: list
    """Ids of the steps that are held back."""


class CampaignAuthor:
    """A person at a campaign; how this one looks and commands is up to the subclass."""

    def __init__(self, method, random):
        self.method, self.random = method, random
        self.counts = Counter()
        self.added = 0

    def look(self):
        """Return what the campaign shows; None if it shows nothing."""
        raise NotImplementedError

    def command(self, action, **given):
        """Send a command: pause, resume, or edit with `edit`; `note` or `choice` answer."""
        raise NotImplementedError

    def act(self):
        """Look once: answer what is asked, end a pause, and now and then edit the queue."""
        seen = self.look()
        if seen is None or seen.has_ended:
            return
        if seen.needs_person:
            self.command("resume", **({"choice": "retry"} if seen.is_question else {"note": "go on"}))
        elif seen.status in ("paused", "pausing"):
            if self.random.random() < 0.5:
                self.command("resume")
        elif self.random.random() < RATE:
            self._edit(seen)

    def _edit(self, seen):
        kind = self.random.choice(("pause_now", "add", "move", "delete", "pause", "do_now", "release"))
        if kind == "pause_now":
            self.command("pause")
            return
        edit = self._make_edit(kind, seen)
        if edit is not None:
            self.command("edit", edit={"edit": kind, **edit})

    def _make_edit(self, kind, seen):
        """Return the fields of an edit; None where the queue has nothing for it."""
        if kind == "release" and seen.held:
            return {"item": seen.held[0]}
        if kind in ("add", "pause", "do_now"):
            if self.added >= MOST_ADDED:
                return None
            self.added += 1
            run = {"run": {"specimen": "D", "method": self.method}}
            return {
                "add": {"steps": [run]},
                "pause": {"before": self.random.choice([None, *seen.pending])},
                "do_now": {"step": {"rest": {"seconds": 5}}},
            }[kind]
        if not seen.pending or kind == "release":
            return None
        item = self.random.choice(seen.pending)
        if kind == "move":
            return {"item": item, "position": self.random.randrange(len(seen.pending))}
        return {"item": item}


class CommandAuthor(CampaignAuthor):
    """A person who uses the functions of ``mrbench campaign`` on the campaign of a folder."""

    def __init__(self, folder, method, random):
        super().__init__(method, random)
        self.folder, self.commands = folder, 0

    def look(self):
        try:
            with open_store(self.folder) as store:
                found = store.list_campaigns(1)
        except BenchError:  # the campaign does not exist yet
            return None
        if not found:
            return None
        state = found[0].state
        return Look(
            status=state.status, has_ended=state.has_ended, needs_person=state.needs_person,
            is_question=state.needs_person and state.active.is_question,
            pending=[item.id for item in state.pending],
            held=[item.id for item in state.items if item.state == "held_back"],
        )  # fmt: skip

    def command(self, action, *, note=None, choice=None, edit=None):
        text = "" if edit is None else json.dumps(edit)
        try:
            with redirect_stdout(io.StringIO()):
                control(action, "", self.folder, "author", note=note, choice=choice, edit=text, as_json=True)
        except CampaignError:
            self.counts["refused"] += 1
        except BenchError as error:
            self.counts[f"failed: {error}"] += 1
        else:
            self.commands += 1
            self.counts[name_command(action, note, choice, edit)] += 1


def name_command(action, note=None, choice=None, edit=None):
    """Return the name under which a command is counted."""
    return edit["edit"] if edit else "answer" if choice or note else action


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
