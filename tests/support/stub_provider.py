"""Provider of sign-ins (OpenID Connect) on the loopback interface, which checks what the service sends."""

import hashlib
import json
import secrets
import time
from base64 import b64decode, urlsafe_b64encode
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread
from typing import Any
from urllib.parse import parse_qs, unquote, urlencode, urlsplit

from joserfc import jwt
from joserfc.jwk import RSAKey

CLIENT, SECRET = "mrbench", "s3cret: with/marks"


def make_key(name: str) -> RSAKey:
    """Return a new key pair."""
    return RSAKey.generate_key(2048, {"kid": name, "use": "sig", "alg": "RS256"})


class StubProvider:
    """Provider that signs one person in without asking; a test changes what it returns."""

    def __init__(self) -> None:
        self.address = ""
        self.signing_key = make_key("first")
        self.published = [self.signing_key]
        """Keys at the address of the keys."""
        self.person: dict[str, Any] = {
            "sub": "4711",
            "preferred_username": "mcurie",
            "name": "Marie Curie",
            "groups": ["lab-engineers"],
        }
        self.changes: dict[str, Any] = {}
        """Claims of the ID token that differ from the right ones; None leaves one out."""
        self.document: dict[str, Any] = {}
        """Fields of the discovery document that differ from the right ones."""
        self.refusal = ""
        """Error in place of a code."""
        self.requests: list[str] = []
        """Paths of all requests."""
        self.faults: list[str] = []
        """Faults of the service at the token endpoint."""
        self.codes: dict[str, dict[str, str]] = {}

    def describe(self) -> dict[str, Any]:
        """Return the discovery document."""
        return {
            "issuer": self.address,
            "authorization_endpoint": f"{self.address}/authorize?theme=plain",
            "token_endpoint": f"{self.address}/token",
            "jwks_uri": f"{self.address}/keys",
            **self.document,
        }

    def authorise(self, query: dict[str, str]) -> str:
        """Return the address to which the browser is sent with a code."""
        answer = {"state": query["state"]}
        if self.refusal:
            answer["error"] = self.refusal
        else:
            answer["code"] = code = secrets.token_urlsafe(8)
            self.codes[code] = query
        return f"{query['redirect_uri']}?{urlencode(answer)}"

    def find_fault(self, form: dict[str, str], authorization: str) -> str:
        """Return the error of a request for a token (RFC 6749, 5.2); empty if it is right."""
        name, _, secret = b64decode(authorization.removeprefix("Basic ")).decode().partition(":")
        given = (
            (unquote(name), unquote(secret))
            if authorization
            else (form.get("client_id"), form.get("client_secret"))
        )
        query = self.codes.pop(form.get("code", ""), None)  # for one use
        challenge = urlsafe_b64encode(hashlib.sha256(form.get("code_verifier", "").encode()).digest())
        if given != (CLIENT, SECRET) or (bool(authorization) == ("client_secret" in form)):
            return "invalid_client"
        if query is None or form.get("redirect_uri") != query["redirect_uri"]:
            return "invalid_grant"
        if query["code_challenge_method"] != "S256" or challenge.decode().rstrip("=") != query["code_challenge"]:
            return "invalid_grant"
        self.nonce = query["nonce"]
        return "" if form.get("grant_type") == "authorization_code" else "unsupported_grant_type"

    def make_token(self) -> str:
        """Return the ID token of the present person."""
        now = int(time.time())
        right = {"iss": self.address, "aud": CLIENT, "iat": now, "exp": now + 300, "nonce": self.nonce}
        claims = {
            key: value for key, value in {**right, **self.person, **self.changes}.items() if value is not None
        }
        return jwt.encode({"alg": "RS256", "kid": self.signing_key.kid}, claims, self.signing_key)


@contextmanager
def served_provider() -> Iterator[StubProvider]:
    """Serve a provider for the duration of a block."""
    provider = StubProvider()

    class Handler(BaseHTTPRequestHandler):
        def log_message(self, *_: Any) -> None:
            pass

        def do_GET(self) -> None:
            parts = urlsplit(self.path)
            provider.requests.append(parts.path)
            if parts.path == "/authorize":
                self._answer(302, location=provider.authorise(_read(parts.query)))
            elif parts.path == "/keys":
                self._answer(200, {"keys": [key.as_dict(private=False) for key in provider.published]})
            else:
                self._answer(200, provider.describe())

        def do_POST(self) -> None:
            provider.requests.append(self.path)
            form = _read(self.rfile.read(int(self.headers["Content-Length"])).decode())
            fault = provider.find_fault(form, self.headers.get("Authorization", ""))
            if fault:
                provider.faults.append(fault)
                self._answer(400, {"error": fault})
            else:
                self._answer(200, {"access_token": "x", "token_type": "Bearer", "id_token": provider.make_token()})

        def _answer(self, status: int, content: object = None, location: str = "") -> None:
            body = json.dumps(content).encode()
            self.send_response(status)
            if location:
                self.send_header("Location", location)
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        provider.address = f"http://127.0.0.1:{server.server_port}"
        thread = Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02})
        thread.start()
        try:
            yield provider
        finally:
            server.shutdown()
            thread.join()


def _read(query: str) -> dict[str, str]:
    return {key: values[0] for key, values in parse_qs(query).items()}
