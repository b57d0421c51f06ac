"""Check of an ID token (OpenID Connect Core 1.0, 3.1.3.7), signature and claims by joserfc."""

from typing import Any

from joserfc import jwt
from joserfc.errors import JoseError
from joserfc.jwk import KeySet

from bench.oidc.faults import Fault, SignInError

_ALGORITHMS = ("RS256", "RS384", "RS512", "PS256", "PS384", "PS512", "ES256", "ES384", "ES512", "Ed25519", "EdDSA")
"""Signatures by public keys only: `none`, or a secret that others know, would prove nothing."""
_LEEWAY = 60
"""Accepted difference between the clocks [s]."""


def decode_id_token(token: str, keys: KeySet) -> dict[str, Any]:
    """Return the claims of a token whose signature is right.

    Raises:
        JoseError: the key is unknown, the signature is wrong, or the token cannot be read.
    """
    return jwt.decode(token, keys, algorithms=_ALGORITHMS).claims


def check_claims(claims: dict[str, Any], issuer: str, client_id: str, nonce: str) -> None:
    """Check that an ID token was made for one sign-in at this service, and has not ended.

    Raises:
        SignInError: a claim is missing or wrong.
    """
    wanted = jwt.JWTClaimsRegistry(
        leeway=_LEEWAY,
        iss={"essential": True, "value": issuer},
        aud={"essential": True, "value": client_id},
        exp={"essential": True},
        iat={"essential": True},
        sub={"essential": True},
        nonce={"essential": True, "value": nonce},
    )
    try:
        wanted.validate(claims)
    except JoseError as error:
        raise SignInError(Fault.TOKEN_INVALID, f"ID token: {error}") from None
    several = isinstance(claims["aud"], list) and len(claims["aud"]) > 1
    if claims.get("azp", None if several else client_id) != client_id:
        raise SignInError(Fault.TOKEN_INVALID, "ID token: azp is of another client, or missing with several aud")
