"""Sign-in by OpenID Connect at a provider of the organisation."""

from bench.oidc.config import OidcConfig, load_oidc_config
from bench.oidc.faults import Fault, SignInError
from bench.oidc.pending import PENDING_LIFETIME, PendingSignIn
from bench.oidc.person import ExternalPerson, normalise_name
from bench.oidc.provider import Provider

__all__ = [
    "PENDING_LIFETIME",
    "ExternalPerson",
    "Fault",
    "OidcConfig",
    "PendingSignIn",
    "Provider",
    "SignInError",
    "load_oidc_config",
    "normalise_name",
]
