"""Commands of `mrbench campaign` on the catalogue of a data folder, also without a service.

A command changes the stored state. The process that executes the campaign acts on it within a second.
"""

from collections.abc import Callable
from pathlib import Path

import typer

from bench.campaigns import (
    CampaignError,
    CampaignState,
    CampaignStore,
    StoredCampaign,
    answer,
    format_view,
    load_campaign,
    make_view,
    parse_choice,
    parse_edit,
    pause,
    read_photo,
    resume,
    save_photo,
    send_due,
    send_test,
    stop,
)
from bench.commands.audit import record
from bench.commands.campaign.catalogue import open_store

_EVENTS = 200
"""Number of newest events that the JSON contains."""


def control(
    action: str,
    target: str,
    data: Path,
    operator: str,
    *,
    note: str | None,
    choice: str | None,
    edit: str,
    as_json: bool,
    photo: Path | None = None,
) -> None:
    """Show or change a campaign.

    Args:
        action: status, pause, resume, stop, edit or test-message.
        target: id of the campaign; empty for the only one in progress, or the newest.
        data: data folder.
        operator: person, for the record.
        note: answer to a prompt, with resume.
        choice: decision on a failed step, with resume.
        edit: edit of the queue as JSON, with edit.
        as_json: print JSON instead of text.
        photo: file of the photo that answers a prompt, with resume.

    Raises:
        BenchError: there is no such campaign, or the command is not possible in its state.
    """
    with open_store(data) as store:
        campaign = _find(store, target)
        if action == "test-message":
            typer.echo(send_test(campaign.state.campaign))
            return
        now = campaign.read_time()
        before = campaign.state.status
        if action == "edit":
            campaign = store.edit(campaign.id, parse_edit(edit, "--edit"), now, operator)
        elif action != "status":
            kept = "" if photo is None else save_photo(store.catalogue.folder, campaign, read_photo(photo))
            change = _make_change(action, campaign, operator, now, note, choice, kept)
            campaign = store.update(campaign.id, change)
        if action != "status":
            given = None if photo is None else str(photo)
            new = {"operator": operator, "note": note, "choice": choice, "edit": edit, "photo": given}
            record(data, f"campaign {action}", campaign.id, {"status": before}, new)
        view = make_view(campaign, store.table.list_newest_events(campaign.id, _EVENTS))
        typer.echo(view.model_dump_json(indent=2) if as_json else "\n".join(format_view(view)))
        if action == "stop":
            send_due(store)  # without a service nobody else would send them


def send_test_of_file(path: Path) -> None:
    """Send a test message to the recipients in the file of a campaign, which need not have started.

    Raises:
        BenchError: the file is no campaign, or has no recipients.
    """
    typer.echo(send_test(load_campaign(path)))


def _make_change(
    action: str, campaign: StoredCampaign, who: str, now: float, note: str | None, choice: str | None, photo: str
) -> Callable[[CampaignState], CampaignState]:
    if action == "pause":
        return lambda state: pause(state, now, who)
    if action == "stop":
        return lambda state: stop(state, now, who)
    # A step that is done during a pause may ask, too; without an answer, resume ends the pause.
    is_given, is_asked = note is not None or choice is not None or bool(photo), campaign.state.needs_person
    if (is_asked and is_given) or ((is_asked or is_given) and campaign.state.status == "running"):
        decision = parse_choice(choice)
        return lambda state: answer(state, now, who, note or "", photo, decision)
    return lambda state: resume(state, now, who)


def _find(store: CampaignStore, target: str) -> StoredCampaign:
    if target:
        return store.get(target)
    in_progress = store.list_in_progress()
    if len(in_progress) > 1:
        names = ", ".join(campaign.id for campaign in in_progress)
        raise CampaignError(f"several campaigns are in progress: {names}; give the id of one")
    found = in_progress or store.list_campaigns(1)
    if not found:
        raise CampaignError(f"{store.catalogue.folder} has no campaign; start one: mrbench campaign run FILE")
    return found[0]
