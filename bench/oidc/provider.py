"""Sign-in by the authorization code flow with PKCE (OpenID Connect Core 1.0, RFC 7636)."""

import hashlib
from base64 import b64encode, urlsafe_b64encode
from typing import Any
from urllib.parse import quote, urlencode, urlsplit

from joserfc.errors import BadSignatureError, InvalidKeyIdError, JoseError

from bench.oidc.config import OidcConfig
from bench.oidc.documents import Addresses, ProviderDocuments
from bench.oidc.faults import Fault, SignInError
from bench.oidc.fetching import Fetcher
from bench.oidc.id_token import check_claims, decode_id_token
from bench.oidc.pending import PendingSignIn, PendingSignIns
from bench.oidc.person import ExternalPerson, read_person


class Provider:
    """Provider of sign-ins; safe from any thread. `begin` and `identify` wait for its answers."""

    def __init__(self, config: OidcConfig) -> None:
        """Use a configuration with its secret; the provider is asked at the first sign-in only.

        Raises:
            ConfigError: the file with its certificates cannot be used.
        """
        self.config = config
        self._fetcher = Fetcher(config.certificate)
        self._documents = ProviderDocuments(config.issuer, self._fetcher)
        self._pending = PendingSignIns()

    def begin(self, redirect_uri: str, view: str) -> tuple[str, str]:
        """Begin a sign-in.

        Args:
            redirect_uri: address to which the provider returns the browser.
            view: address within the page that is shown afterwards.

        Returns:
            Address at the provider, and the secret for a cookie of the browser.

        Raises:
            SignInError: the provider does not answer as it must.
        """
        endpoint = self._documents.get_addresses().authorization_endpoint
        begun, secret = self._pending.begin(redirect_uri, view)
        query = {
            "response_type": "code",
            "client_id": self.config.client_id,
            "redirect_uri": redirect_uri,
            "scope": " ".join(self.config.scopes),
            "state": begun.state,
            "nonce": begun.nonce,
            "code_challenge": _compute_challenge(begun.verifier),
            "code_challenge_method": "S256",
        }
        return f"{endpoint}{'&' if urlsplit(endpoint).query else '?'}{urlencode(query)}", secret

    def take(self, state: str, secret: str) -> PendingSignIn:
        """Return the sign-in that a browser has begun, and end it.

        Raises:
            SignInError: it is unknown, was taken before, is too old, or belongs to another browser.
        """
        found = self._pending.take(state, secret)
        if found is None:
            raise SignInError(Fault.STATE_UNKNOWN, "the sign-in is unknown, ended, too old or of another browser")
        return found

    def identify(self, pending: PendingSignIn, code: str) -> ExternalPerson:
        """Return who has signed in at the provider.

        Raises:
            SignInError: the provider refuses the code, or its ID token is not valid.
        """
        token = self._exchange(pending, code)
        claims = self._decode(token)
        check_claims(claims, self.config.issuer, self.config.client_id, pending.nonce)
        return read_person(claims, self.config)

    def _exchange(self, pending: PendingSignIn, code: str) -> str:
        """Return the ID token for a code."""
        addresses = self._documents.get_addresses()
        fields, headers = self._make_credentials(addresses)
        form = {
            "grant_type": "authorization_code",
            "code": code,
            "redirect_uri": pending.redirect_uri,
            "code_verifier": pending.verifier,
            **fields,
        }
        token = self._fetcher.post(addresses.token_endpoint, form, headers).get("id_token")
        if not isinstance(token, str):
            raise SignInError(Fault.PROVIDER_UNUSABLE, "the token endpoint returned no id_token")
        return token

    def _make_credentials(self, addresses: Addresses) -> tuple[dict[str, str], dict[str, str]]:
        """Return form fields and headers that prove who the service is (RFC 6749, 2.3.1)."""
        name = self.config.client_id
        secret = self.config.client_secret.get_secret_value() if self.config.client_secret else ""
        if "client_secret_basic" in addresses.token_endpoint_auth_methods_supported:
            pair = f"{quote(name, safe='')}:{quote(secret, safe='')}"
            return {}, {"Authorization": f"Basic {b64encode(pair.encode()).decode()}"}
        return {"client_id": name, "client_secret": secret}, {}

    def _decode(self, token: str) -> dict[str, Any]:
        """Return the claims of an ID token; unless a known key fits, the keys are fetched again, once."""
        keys = self._documents.get_keys()
        try:
            try:
                return decode_id_token(token, keys)
            except (InvalidKeyIdError, BadSignatureError):
                return decode_id_token(token, self._documents.get_keys(renew=True))
        except (JoseError, ValueError) as error:
            raise SignInError(Fault.TOKEN_INVALID, f"ID token: {error}") from None


def _compute_challenge(verifier: str) -> str:
    return urlsafe_b64encode(hashlib.sha256(verifier.encode()).digest()).rstrip(b"=").decode()
