"""Reasons for which a sign-in by the provider fails."""

from enum import StrEnum

from bench.errors import BenchError


class Fault(StrEnum):
    """Kinds of failure; the page has a sentence for each, so that no text of others is shown there."""

    PROVIDER_UNREACHABLE = "provider-unreachable"
    """The provider does not answer."""
    PROVIDER_UNUSABLE = "provider-unusable"
    """An answer of the provider is not what the standard prescribes."""
    REFUSED = "refused"
    """The provider has refused, or the person has given up there."""
    STATE_UNKNOWN = "state-unknown"
    """The sign-in was not begun in this browser, was ended before, or took too long."""
    CODE_REFUSED = "code-refused"
    """The provider gave no token for its code."""
    TOKEN_INVALID = "token-invalid"
    """The ID token is not valid for this sign-in."""
    NAME_UNUSABLE = "name-unusable"
    """The claim of the user name is missing, or is no possible name."""
    NAME_TAKEN = "name-taken"
    """A local user, or another person of the provider, has the name."""
    ROLE_MISSING = "role-missing"
    """The person is in no group with a role."""
    DISABLED = "disabled"
    """The user is disabled here."""


class SignInError(BenchError):
    """A sign-in by the provider failed; the message is for the log and contains no secret."""

    def __init__(self, fault: Fault, reason: str) -> None:
        super().__init__(reason)
        self.fault = fault
