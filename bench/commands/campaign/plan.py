"""`mrbench campaign plan`: dry run of a whole campaign."""

from pathlib import Path

import typer

from bench.campaigns import (
    Campaign,
    Methods,
    collect_methods,
    find_shipped_method,
    format_plan,
    load_campaign,
    plan_campaign,
)
from bench.catalogue import has_catalogue
from bench.commands.campaign.catalogue import open_store
from bench.disk import find_usable_space
from bench.runs import assess_design


def plan(path: Path, data: Path, *, quick: bool, as_json: bool) -> None:
    """Print the dry run of a campaign.

    Args:
        path: file of the campaign.
        data: data folder, for the free space and the stored methods; it need not exist.
        quick: leave out what the strokes can identify.
        as_json: print JSON instead of text.

    Raises:
        BenchError: the campaign is invalid.
    """
    document = load_campaign(path)
    methods = _collect(document, data)
    made = plan_campaign(document, methods, None if quick else assess_design, find_usable_space(data))
    typer.echo(made.model_dump_json(by_alias=True, indent=2) if as_json else "\n".join(format_plan(made)))


def _collect(document: Campaign, data: Path) -> Methods:
    """Return the methods of a campaign; without a catalogue only shipped ones have names."""
    if not has_catalogue(data):
        return collect_methods(document, find_shipped_method, allow_files=True)
    with open_store(data) as store:
        return collect_methods(document, store.find_method, allow_files=True)
