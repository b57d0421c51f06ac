"""Campaigns that require approved methods."""

from collections.abc import Iterable

from bench.campaigns import AnyStep, Campaign, CampaignError, Methods, get_step_kind
from bench.service.context import ServiceContext


def check_approvals(
    context: ServiceContext, campaign: Campaign, steps: Iterable[AnyStep], methods: Methods
) -> None:
    """Check the steps of a campaign, or those that are added to it.

    Args:
        context: objects of the service.
        campaign: document; nothing is checked unless it requires approved methods.
        steps: steps to check.
        methods: their methods by name.

    Raises:
        CampaignError: a method is not approved in its present content, or is only proposed during the campaign.
    """
    if campaign.methods != "approved":
        return
    if any(get_step_kind(step) == "next_stroke" for step in steps):
        raise CampaignError("proposed strokes are no approved methods; leave out next_stroke, or approved methods")
    hashes = {name: method.compute_sha256() for name, method in methods.items()}
    approved = context.catalogue.approvals.find(hashes.values())
    missing = ", ".join(sorted(name for name, sha256 in hashes.items() if sha256 not in approved))
    if missing:
        raise CampaignError(f"the campaign requires approved methods; not approved: {missing}")
