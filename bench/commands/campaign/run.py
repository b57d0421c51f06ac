"""`mrbench campaign run --scenario`: a campaign on the simulated plant, in this process."""

import threading
import time
from pathlib import Path

import typer

from bench.campaigns import (
    SIMULATED,
    CampaignRunner,
    CampaignStore,
    Message,
    NotificationSender,
    PlantBench,
    StoredCampaign,
    collect_methods,
    load_campaign,
    lock_campaign,
    make_view,
    send_due,
)
from bench.commands.campaign.catalogue import open_store
from bench.processes import set_on_signals


def run_on_plant(
    path: Path, scenario: str, data: Path, operator: str, *, identify: bool, is_new: bool, as_json: bool
) -> None:
    """Run a campaign on the simulated plant, or continue it after a crash.

    Args:
        path: file of the campaign.
        scenario: name or file of the scenario.
        data: data folder, created if it is missing.
        operator: person, for the record.
        identify: identify and diagnose every run.
        is_new: start again, also if an equal campaign is not finished.
        as_json: print the final state as JSON.

    Raises:
        BenchError: the campaign is invalid, cannot be met, or is executed by another process.
    """
    with open_store(data, is_created=True) as store:
        campaign = _find_or_create(store, path, scenario, operator, is_new=is_new)
        bench = PlantBench(store.catalogue, scenario, campaign.state.updated, identify=identify)
        stopping = threading.Event()
        with lock_campaign(store.catalogue.folder, campaign.id), set_on_signals(stopping):
            bench.check_needs(campaign.state.campaign, [item.step for item in campaign.state.items])
            runner = CampaignRunner(store, campaign.id, bench, None if as_json else _print_message)
            with NotificationSender(store):
                ended = runner.run(stopping.is_set)
            send_due(store)
        if as_json:
            typer.echo(make_view(ended, store.table.list_newest_events(ended.id, 200)).model_dump_json(indent=2))
        elif not ended.state.has_ended:
            typer.echo(f"{ended.id} is interrupted; the same command continues it", err=True)


def _find_or_create(
    store: CampaignStore, path: Path, scenario: str, operator: str, *, is_new: bool
) -> StoredCampaign:
    document = load_campaign(path)
    methods = collect_methods(document, store.find_method, allow_files=True)
    bench = f"{SIMULATED}{scenario}"
    unfinished = None if is_new else store.find_unfinished(document, methods, bench)
    if unfinished is not None:
        typer.echo(f"{unfinished.id} is not finished and continues; --new starts again", err=True)
        return unfinished
    return store.create(document, methods, bench, time.time(), operator)


def _print_message(message: Message) -> None:
    typer.echo(message.text, err=True)
