"""Roles, and the rights that each contains."""

from collections.abc import Iterable
from typing import Literal, TypeAlias, get_args

Role: TypeAlias = Literal["viewer", "technician", "engineer", "administrator"]
"""Each role has the rights of those before it."""
Right: TypeAlias = Literal[
    "view",
    "stop",
    "operate",
    "analyse",
    "reset_trip",
    "manage_methods",
    "approve_methods",
    "change_limits",
    "manage_runs",
    "sign_reports",
    "administer",
]
"""Permission of a person or program.

- ``view``: read everything but people, tokens of others and the audit trail.
- ``stop``: stop and abort what moves.
- ``operate``: setup steps, runs, campaigns, notes, uploads.
- ``analyse``: identifications, diagnoses and other jobs.
- ``reset_trip``: release the bench after a trip.
- ``manage_methods``: store methods; ``approve_methods``: approve them for campaigns.
- ``change_limits``: limits and calibration of the bench.
- ``manage_runs``: trash, restore and salvage runs.
- ``sign_reports``: sign reports on runs and campaigns.
- ``administer``: people, tokens of others, audit trail.
"""
ROLES: tuple[Role, ...] = get_args(Role)
RIGHTS: tuple[Right, ...] = get_args(Right)
_ADDED: dict[Role, tuple[Right, ...]] = {
    "viewer": ("view", "stop"),
    "technician": ("operate", "analyse", "sign_reports"),
    "engineer": ("reset_trip", "manage_methods", "approve_methods", "change_limits", "manage_runs"),
    "administrator": ("administer",),
}
"""Rights that each role adds to those of the roles before it."""


def compute_rights(role: Role, extra: Iterable[Right] = ()) -> frozenset[Right]:
    """Return the rights of a role, with further ones that a person was given."""
    contained = ROLES[: ROLES.index(role) + 1]
    return frozenset(right for one in contained for right in _ADDED[one]) | frozenset(extra)


def find_roles(right: Right) -> tuple[Role, ...]:
    """Return the roles that contain a right."""
    return tuple(role for role in ROLES if right in compute_rights(role))
