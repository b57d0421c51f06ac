"""Methods of a campaign by name: shipped, stored in a catalogue, given as documents, or in files."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeAlias

from bench.campaigns.document.document import Campaign
from bench.campaigns.document.errors import CampaignDocumentError
from bench.campaigns.document.expansion import expand_campaign
from bench.campaigns.document.steps import RunSpec, Step
from bench.campaigns.document.strokes import Methods, get_method_name, list_runs, make_run_method
from bench.catalogue import SHIPPED_VERSION
from bench.errors import MethodError
from bench.methods import Method, list_shipped_methods, load_method, parse_method

FindMethod: TypeAlias = Callable[[str, int | None], Method | None]
"""Function that returns a version of a named method, by default its newest; None if there is no such version."""


def find_shipped_method(name: str, version: int | None = None) -> Method | None:
    """Return a shipped method; None if there is no such method or version."""
    is_shipped = name in list_shipped_methods() and version in (None, SHIPPED_VERSION)
    return load_method(name) if is_shipped else None


def prefer_methods(methods: Methods, find: FindMethod) -> FindMethod:
    """Return a function that finds the methods of a campaign before others; a version is always looked up."""

    def find_preferred(name: str, version: int | None = None) -> Method | None:
        present = methods.get(name) if version is None else None
        return find(name, version) if present is None else present

    return find_preferred


def collect_methods(
    campaign: Campaign, find: FindMethod = find_shipped_method, *, allow_files: bool = False
) -> dict[str, Method]:
    """Return all methods of a campaign by name, fixed for its whole duration.

    Args:
        campaign: the campaign.
        find: finds a method by name and version; by default among the shipped ones.
        allow_files: whether a method may be named by its file.

    Raises:
        CampaignDocumentError: a method is missing or invalid, or two different ones have the same name.
    """
    return collect_step_methods(expand_campaign(campaign), find, allow_files=allow_files)


def collect_step_methods(
    steps: Iterable[Step], find: FindMethod = find_shipped_method, *, allow_files: bool = False
) -> dict[str, Method]:
    """Return the methods of steps by name.

    Args:
        steps: steps, of which those with a run have a method.
        find: finds a method by name and version; by default among the shipped ones.
        allow_files: whether a method may be named by its file.

    Raises:
        CampaignDocumentError: a method is missing or invalid, or two different ones have the same name.
    """
    known: dict[tuple[str, int | None], Method] = {}
    methods: dict[str, Method] = {}
    for run in list_runs(steps):
        if isinstance(run.method, str):  # a matrix names the same method in many runs
            key = run.method, run.method_version
            method = known.get(key) or known.setdefault(key, _find(*key, find, allow_files=allow_files))
        else:
            method = _parse(run.method)
        _add(methods, method, run)
        make_run_method(methods, run)
    return methods


def _add(methods: dict[str, Method], method: Method, run: RunSpec) -> None:
    if get_method_name(run) != method.name:
        raise CampaignDocumentError(f"file {run.method} has the method {method.name}; name it {method.name}.json")
    if methods.setdefault(method.name, method) != method:
        raise CampaignDocumentError(
            f"two different methods or versions are named {method.name}; give each its own name"
        )


def _find(name: str, version: int | None, find: FindMethod, *, allow_files: bool) -> Method:
    try:
        found = find(name, version)
        if found is None and allow_files and version is None:
            return load_method(name)
    except MethodError as error:
        raise CampaignDocumentError(str(error)) from None
    if found is not None:
        return found
    if version is not None:
        raise CampaignDocumentError(
            f"there is no version {version} of method {name[:80]}; leave method_version out for the newest"
        )
    names = ", ".join(list_shipped_methods())
    raise CampaignDocumentError(
        f"there is no method {name[:80]}; give a stored one, its document, or one of {names}"
    )


def _parse(document: Mapping[str, Any]) -> Method:
    try:
        return parse_method(document, "the method of a run")
    except MethodError as error:
        raise CampaignDocumentError(str(error)) from None
