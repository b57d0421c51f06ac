"""Errors of campaigns."""

from bench.errors import BenchError


class CampaignError(BenchError):
    """A campaign is invalid, or a command is not possible in its present state."""


class NoWorkerError(CampaignError):
    """A condition needs results of runs, but no worker is connected that could identify them."""


class CampaignDocumentError(CampaignError):
    """A campaign document, or a method in it, is invalid."""
