"""Mountings of the specimens: which runs of a campaign were made without a change of the mounting between them."""

import re
from collections.abc import Mapping

from bench.campaigns import CampaignState, Item

MOUNTING_RULE = (
    "A new mounting of a specimen begins with its first run, after a run of another specimen, and after an"
    " answered prompt whose text contains “mount”, such as “Remount the damper”, or the setup step mount. Other"
    " steps separate no mountings. Work that the campaign does not ask for is not known to this report."
)
"""Rule by which runs belong to a mounting, for a person."""
_MOUNT = re.compile("mount", re.IGNORECASE)


def number_mountings(state: CampaignState) -> Mapping[str, int]:
    """Return the number of the mounting of each complete run by its id, counted from 1 for each specimen.

    The order of the steps decides, not their times: on the simulated plant, answers have another clock than runs.
    """
    places = {item.id: place for place, item in enumerate(state.items)}
    remounts = [places[item.id] for item in state.items if is_remount(item)]
    numbers: dict[str, int] = {}
    latest: dict[str, int] = {}
    present, reached = "", -1
    for fact in state.facts:
        place = places[fact.item]
        if fact.specimen != present or any(reached < remount < place for remount in remounts):
            latest[fact.specimen] = latest.get(fact.specimen, 0) + 1
        # A step that was released again comes after later ones, and the prompts between count once.
        present, reached = fact.specimen, max(reached, place)
        numbers[fact.run] = latest[fact.specimen]
    return numbers


def is_remount(item: Item) -> bool:
    """Return whether an item is an answered prompt that asks for a mounting, or a mounting that was done."""
    if item.state != "done":
        return False
    setup, prompt = (getattr(item.step, kind, None) for kind in ("setup", "prompt"))
    if setup is not None:
        return bool(setup.step == "mount")
    return prompt is not None and _MOUNT.search(prompt.text) is not None
