"""Needs of a campaign that are checked before its first step, and before steps are added to it.

They are checked in one place, so that a campaign is refused for the same reasons in the page, by REST and on the
command line. Needs of the instruments, such as a thermometer, are checked by the bench.
"""

from collections.abc import Callable, Iterable

from bench.campaigns.document import Campaign, CampaignError, Methods, NextStrokeStep, NoWorkerError, Step
from bench.campaigns.engine import needs_results
from bench.catalogue import ApprovalStore


def check_approvals(approvals: ApprovalStore, campaign: Campaign, steps: Iterable[Step], methods: Methods) -> None:
    """Check that the methods of steps are approved if their campaign requires it.

    Args:
        approvals: approvals of a catalogue.
        campaign: document; nothing is checked unless it requires approved methods.
        steps: steps of the campaign, or those that are added to it.
        methods: methods of these steps by name.

    Raises:
        CampaignError: a method is not approved in its present content, or is only proposed during the campaign.
    """
    if campaign.methods != "approved":
        return
    if any(isinstance(step, NextStrokeStep) for step in steps):
        raise CampaignError("proposed strokes are no approved methods; leave out next_stroke, or approved methods")
    hashes = {name: method.compute_sha256() for name, method in methods.items()}
    approved = approvals.find(hashes.values())
    missing = ", ".join(sorted(name for name, sha256 in hashes.items() if sha256 not in approved))
    if missing:
        raise CampaignError(f"the campaign requires approved methods; not approved: {missing}")


def check_worker(campaign: Campaign, steps: Iterable[Step], describe_worker: Callable[[], str]) -> None:
    """Check that a worker can identify the runs if a condition needs their results.

    Args:
        campaign: document with the conditions that stop it.
        steps: steps of the campaign, or those that are added to it.
        describe_worker: returns `ok`, or the reason why there is none; called only if results are needed.

    Raises:
        NoWorkerError: a condition needs results, and no worker is connected.
    """
    if not needs_results(campaign, steps):
        return
    worker = describe_worker()
    if worker != "ok":
        raise NoWorkerError(f"a condition of the campaign needs identifications, but there is no worker: {worker}")
