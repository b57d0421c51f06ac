"""Person in the claims of an ID token."""

import unicodedata
from dataclasses import dataclass
from typing import Any

from bench.oidc.config import OidcConfig
from bench.oidc.faults import Fault, SignInError
from bench.people import Role

_MAX_FULL_NAME = 200


@dataclass(frozen=True)
class ExternalPerson:
    """Person of the provider."""

    external_id: str
    """Issuer and subject, which the provider never gives to another person."""
    name: str
    """Proposed user name."""
    full_name: str
    role: Role | None
    """Role by the groups; None for a person without one, who is refused."""


def read_person(claims: dict[str, Any], config: OidcConfig) -> ExternalPerson:
    """Return the person of an ID token that was checked.

    Raises:
        SignInError: the claim of the user name is missing.
    """
    name = claims.get(config.user_claim)
    if not isinstance(name, str):
        raise SignInError(Fault.NAME_UNUSABLE, f"the ID token has no claim {config.user_claim}; see user_claim")
    return ExternalPerson(
        external_id=f"{claims['iss']} {claims['sub']}",
        name=normalise_name(name),
        full_name=_clean(claims.get("name")),
        role=config.find_role(_read_groups(claims.get(config.groups_claim))),
    )


def normalise_name(name: str) -> str:
    """Return a name of the provider as a user name here.

    The part before an ``@`` counts. Letters become small and lose their accents, and spaces become dots.
    """
    letters = unicodedata.normalize("NFKD", name.partition("@")[0].strip().lower())
    plain = "".join(letter for letter in letters if not unicodedata.combining(letter))
    return ".".join(plain.split())


def _clean(full_name: object) -> str:
    text = full_name if isinstance(full_name, str) else ""
    return "".join(filter(str.isprintable, text)).strip()[:_MAX_FULL_NAME]


def _read_groups(given: object) -> set[str]:
    """Return the groups; some providers give a single one as a text."""
    groups = given if isinstance(given, list) else [given]
    return {group for group in groups if isinstance(group, str)}
