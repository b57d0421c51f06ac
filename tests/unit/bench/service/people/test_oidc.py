"""Sign-in by a provider, against one on the loopback interface."""

import hashlib
import hmac
import json
import logging
import time
from base64 import urlsafe_b64encode
from urllib.parse import parse_qs, urlsplit
from urllib.request import HTTPErrorProcessor, build_opener

import pytest

from bench.oidc import Fault, OidcConfig
from tests.support.stub_provider import CLIENT, SECRET, make_key, served_provider
from tests.unit.bench.service.people.conftest import Browser

HOME = "http://127.0.0.1:8600/#"
ENGINEERS = {"lab-engineers": "engineer", "lab-heads": "administrator", "lab-guests": "viewer"}


class _KeptRedirect(HTTPErrorProcessor):
    def http_response(self, request, response):
        return response


_WEB = build_opener(_KeptRedirect)


class Journey:
    """A browser's way to the provider and back; the cookies are in the client of the service."""

    def __init__(self, service, provider):
        self.service, self.provider = service, provider

    def begin(self, **query):
        """Return the address at the provider."""
        answer = self.service.client.get("/api/v1/session/oidc", params=query, follow_redirects=False)
        assert answer.status_code == 303, answer.text
        return answer.headers["location"]

    def visit_provider(self, address):
        """Return the address to which the provider sends the browser."""
        with _WEB.open(address, timeout=10) as answer:
            return answer.headers["Location"]

    def end(self, callback):
        """Return the address within the page, after the service's own."""
        answer = self.service.client.get(callback, follow_redirects=False)
        assert answer.status_code == 303, answer.text
        assert answer.headers["location"].startswith(HOME)
        return answer.headers["location"].removeprefix(HOME)

    def sign_in(self, **query):
        return self.end(self.visit_provider(self.begin(**query)))

    def fail(self):
        """Sign in in vain, and return the kind of failure."""
        shown = parse_qs(self.sign_in())
        assert self.service.client.get("/api/v1/session").status_code == 401
        return Fault(shown["problem"][0])

    def get_person(self):
        answer = self.service.client.get("/api/v1/session")
        assert answer.status_code == 200, answer.text
        return answer.json()["person"]

    def open_other_browser(self):
        self.service.client.cookies.clear()


@pytest.fixture
def provider():
    with served_provider() as made:
        yield made


@pytest.fixture
def start(service, provider):
    """Return a function that starts the service with the provider."""

    def start_one(**changes):
        given = {"issuer": provider.address, "client_id": CLIENT, "client_secret": SECRET, "name": "Lab account"}
        service.start(oidc=OidcConfig.model_validate({**given, "roles": ENGINEERS, **changes}))
        del service.client.headers["Authorization"]
        return Journey(service, provider)

    return start_one


@pytest.fixture
def journey(start):
    return start()


@pytest.fixture
def administrator(journey, service):
    """Return a program with the bench's own token."""
    return make_administrator(service)


def make_administrator(service):
    program = Browser(service)
    program.token = service.token
    return program


def test_the_page_learns_the_ways_to_sign_in(service, start):
    del service.client.headers["Authorization"]
    assert service.get("/session/ways") == {"password": True, "oidc": None}
    assert service.client.get("/api/v1/session/oidc").status_code == 404
    assert service.client.get("/api/v1/session/oidc/callback").status_code == 404
    start()
    assert service.get("/session/ways") == {"password": True, "oidc": {"name": "Lab account"}}


def test_a_person_of_the_provider_signs_in_with_the_role_of_the_group(journey, service, provider):
    assert journey.sign_in(view="/runs/R1?part=fit") == "/runs/R1?part=fit"
    person = journey.get_person()
    assert (person["name"], person["full_name"], person["role"]) == ("mcurie", "Marie Curie", "engineer")
    (user,) = list_users(service)
    assert user["external"]
    assert not user["has_password"]
    assert user["last_seen"] is not None
    assert provider.faults == []


def list_users(service):
    cookies = dict(service.client.cookies)
    service.client.cookies.clear()
    items = make_administrator(service).get("/users")["items"]
    service.client.cookies.update(cookies)
    return items


def test_the_cookies_are_out_of_reach_for_scripts_and_other_sites(journey, service):
    address = journey.begin()
    begun = service.client.get("/api/v1/session/oidc", follow_redirects=False).headers["set-cookie"].lower()
    assert "httponly" in begun
    assert "samesite=lax" in begun
    assert "path=/api/v1/session/oidc" in begun
    service.client.cookies.clear()
    callback = journey.visit_provider(journey.begin())
    cookies = service.client.get(callback, follow_redirects=False).headers.get_list("set-cookie")
    (session,) = (one.lower() for one in cookies if "_oidc=" not in one)
    assert "httponly" in session
    assert "samesite=strict" in session
    query = parse_qs(urlsplit(address).query)
    assert query["theme"] == ["plain"]
    assert query["scope"] == ["openid profile"]
    assert len(query["state"][0]) >= 43
    assert len(query["nonce"][0]) >= 43


@pytest.mark.parametrize("view", ["https://evil.example/", "//evil.example", "\r\nX: y", "", "/" * 1001])
def test_no_view_leads_away_from_the_page(journey, view):
    assert journey.sign_in(view=view) in ("/", "//evil.example")


def test_credentials_go_into_the_form_for_a_provider_that_wants_them_there(journey, provider):
    provider.document["token_endpoint_auth_methods_supported"] = ["client_secret_post"]
    assert journey.sign_in() == "/"
    assert journey.get_person()["name"] == "mcurie"


@pytest.mark.parametrize(
    "changes",
    [
        {"nonce": "another"},
        {"nonce": None},
        {"aud": "another"},
        {"aud": [CLIENT, "another"]},
        {"aud": [CLIENT, "another"], "azp": "another"},
        {"azp": "another"},
        {"aud": None},
        {"iss": "https://another.example"},
        {"exp": None},
        {"sub": None},
    ],
    ids=str,
)
def test_an_id_token_for_something_else_is_refused(journey, provider, changes):
    provider.changes = changes
    assert journey.fail() is Fault.TOKEN_INVALID


# Offsets, because workers that run tests in parallel must collect the same names.
@pytest.mark.parametrize(("claim", "offset"), [("exp", -120), ("iat", 3600)])
def test_an_id_token_for_another_time_is_refused(journey, provider, claim, offset):
    provider.changes = {claim: int(time.time()) + offset}
    assert journey.fail() is Fault.TOKEN_INVALID


def test_several_audiences_are_accepted_if_the_token_was_made_for_this_service(journey, provider):
    provider.changes = {"aud": [CLIENT, "another"], "azp": CLIENT}
    journey.sign_in()
    assert journey.get_person()["name"] == "mcurie"


def test_a_wrong_signature_is_refused(journey, provider):
    provider.signing_key = make_key("first")  # the name of the published key
    assert journey.fail() is Fault.TOKEN_INVALID
    assert provider.requests.count("/keys") == 2


@pytest.mark.parametrize("algorithm", ["none", "HS256"])
def test_a_token_that_is_not_signed_by_a_private_key_is_refused(journey, provider, monkeypatch, algorithm):
    public = provider.signing_key.as_pem(private=False)

    def encode(_header, claims, _key):
        parts = [_encode(json.dumps(part).encode()) for part in ({"alg": algorithm, "kid": "first"}, claims)]
        signature = hmac.new(public, ".".join(parts).encode(), hashlib.sha256).digest()
        return ".".join([*parts, _encode(signature) if algorithm == "HS256" else ""])

    monkeypatch.setattr("tests.support.stub_provider.jwt.encode", encode)
    assert journey.fail() is Fault.TOKEN_INVALID
    assert provider.faults == []


def _encode(content):
    return urlsafe_b64encode(content).decode().rstrip("=")


def test_keys_are_fetched_again_after_a_rotation(journey, provider):
    journey.sign_in()
    journey.open_other_browser()
    provider.signing_key = make_key("second")
    assert journey.fail() is Fault.TOKEN_INVALID  # it is not published yet
    provider.published = [provider.signing_key]
    journey.open_other_browser()
    journey.sign_in()
    assert journey.get_person()["name"] == "mcurie"
    assert provider.requests.count("/.well-known/openid-configuration") == 1


def test_a_sign_in_ends_once(journey):
    callback = journey.visit_provider(journey.begin(view="/runs"))
    assert journey.end(callback) == "/runs"
    assert journey.end(callback) == "problem=state-unknown&view=/"


def test_a_sign_in_of_another_browser_is_refused(journey, provider):
    callback = journey.visit_provider(journey.begin())
    journey.open_other_browser()
    assert journey.end(callback) == "problem=state-unknown&view=/"
    assert "/token" not in provider.requests


@pytest.mark.parametrize("query", ["", "?state=x", "?code=x", "?state=x&code=x", "?error=access_denied"])
def test_an_answer_without_a_sign_in_is_refused(journey, query):
    assert journey.end(f"/api/v1/session/oidc/callback{query}") == "problem=state-unknown&view=/"


def test_a_sign_in_that_takes_too_long_is_refused(journey, service, monkeypatch):
    callback = journey.visit_provider(journey.begin())
    now = time.monotonic()
    monkeypatch.setattr(service.client.app.state.context.provider._pending, "_clock", lambda: now + 601)
    assert journey.end(callback) == "problem=state-unknown&view=/"


def test_a_refusal_by_the_provider_returns_to_the_view(journey, provider):
    provider.refusal = "access_denied"
    assert journey.sign_in(view="/plan") == "problem=refused&view=/plan"


def test_a_code_that_the_provider_refuses_is_logged_without_secrets(journey, provider, caplog):
    callback = journey.visit_provider(journey.begin())
    provider.codes.clear()
    with caplog.at_level(logging.WARNING):
        assert journey.end(callback) == "problem=code-refused&view=/"
    (record,) = (one for one in caplog.records if one.msg == "sign_in_failed")
    assert record.fault == "code-refused"
    assert record.reason.endswith("/token answered 400 invalid_grant")
    assert provider.faults == ["invalid_grant"]


def test_a_wrong_secret_of_the_service_is_refused_by_the_provider(start, provider):
    assert start(client_secret="wrong").fail() is Fault.CODE_REFUSED
    assert provider.faults == ["invalid_client"]


def test_a_provider_that_is_down_does_not_stop_the_service(start, service, provider, monkeypatch):
    journey = start(issuer="http://127.0.0.1:9", client_secret=SECRET)
    answer = service.client.get("/api/v1/session/oidc", params={"view": "/runs"}, follow_redirects=False)
    assert answer.headers["location"] == f"{HOME}problem=provider-unreachable&view=/runs"
    assert "set-cookie" not in answer.headers
    assert service.get("/health")
    assert make_administrator(service).send("GET", "/runs").status_code == 200
    assert journey.provider.requests == []


def test_a_provider_that_goes_down_during_a_sign_in_is_reported(journey, monkeypatch, service):
    callback = journey.visit_provider(journey.begin())
    addresses = service.client.app.state.context.provider._documents.get_addresses()
    monkeypatch.setattr(addresses, "token_endpoint", "http://127.0.0.1:9/token")
    assert journey.end(callback) == "problem=provider-unreachable&view=/"


@pytest.mark.parametrize(
    "document",
    [
        {"issuer": "https://another.example"},
        {"token_endpoint": "http://provider.example/token"},
        {"jwks_uri": None},
        {"authorization_endpoint": "javascript:alert(1)"},
    ],
    ids=str,
)
def test_a_discovery_document_that_cannot_be_trusted_is_refused(journey, service, provider, document):
    provider.document = document
    answer = service.client.get("/api/v1/session/oidc", follow_redirects=False)
    assert answer.headers["location"] == f"{HOME}problem=provider-unusable&view=/"


def test_keys_that_cannot_be_read_are_reported(journey, provider):
    provider.published = []
    assert journey.fail() is Fault.PROVIDER_UNUSABLE


def test_the_role_follows_the_groups_at_each_sign_in(journey, provider):
    for groups, role in (
        (["others", "lab-guests"], "viewer"),
        (["lab-guests", "lab-heads"], "administrator"),
        ("lab-engineers", "engineer"),
    ):
        provider.person["groups"] = groups
        journey.sign_in()
        assert journey.get_person()["role"] == role


def test_a_person_without_a_mapped_group_is_refused_and_signed_out(journey, provider, service):
    journey.sign_in()
    cookies = dict(service.client.cookies)
    provider.person["groups"] = ["others"]
    journey.open_other_browser()
    assert journey.fail() is Fault.ROLE_MISSING
    service.client.cookies.update(cookies)
    assert service.client.get("/api/v1/session").status_code == 401


def test_a_person_without_a_mapped_group_has_the_role_that_the_configuration_gives(start, provider):
    journey = start(role_without_group="viewer")
    del provider.person["groups"]
    journey.sign_in()
    assert journey.get_person()["role"] == "viewer"


def test_a_disabled_user_is_refused_at_once(journey, service):
    journey.sign_in()
    cookies = dict(service.client.cookies)
    journey.open_other_browser()
    administrator = make_administrator(service)
    assert administrator.send("PATCH", "/users/mcurie", {"disabled": True}).status_code == 200
    service.client.cookies.update(cookies)
    assert service.client.get("/api/v1/session").status_code == 401
    journey.open_other_browser()
    assert journey.fail() is Fault.DISABLED


def test_a_local_user_of_the_same_name_is_not_taken_over(administrator, journey):
    body = {"name": "mcurie", "full_name": "Local", "role": "administrator", "password": "correct horse battery"}
    assert administrator.send("POST", "/users", body).status_code == 201
    assert journey.fail() is Fault.NAME_TAKEN
    (user,) = administrator.get("/users")["items"]
    assert (user["full_name"], user["external"], user["has_password"]) == ("Local", False, True)


def test_another_person_of_the_provider_does_not_inherit_a_name(administrator, journey, provider):
    journey.sign_in()
    journey.open_other_browser()
    provider.person["sub"] = "4712"
    assert journey.fail() is Fault.NAME_TAKEN
    assert len(administrator.get("/users")["items"]) == 1


def test_a_person_who_is_renamed_keeps_the_user(administrator, journey, provider):
    journey.sign_in()
    provider.person.update(preferred_username="msklodowska", name="Maria Skłodowska")
    journey.sign_in()
    person = journey.get_person()
    assert (person["name"], person["full_name"]) == ("mcurie", "Maria Skłodowska")


@pytest.mark.parametrize("name", ["7", "x", "böse/zeichen", "", None, 7])
def test_a_name_that_cannot_be_a_user_name_is_refused(administrator, journey, provider, name):
    provider.person["preferred_username"] = name
    assert journey.fail() is Fault.NAME_UNUSABLE
    assert administrator.get("/users")["items"] == []


@pytest.mark.parametrize(
    "change", [{"password": "correct horse battery"}, {"role": "administrator"}, {"full_name": "X"}], ids=str
)
def test_what_the_provider_administers_is_not_changed_here(administrator, journey, change):
    journey.sign_in()
    journey.open_other_browser()
    answer = administrator.send("PATCH", "/users/mcurie", change)
    assert answer.status_code == 409
    assert answer.json()["type"] == "urn:mrbench:problem:external-user"
    (user,) = administrator.get("/users")["items"]
    assert (user["has_password"], user["role"], user["full_name"]) == (False, "engineer", "Marie Curie")


def test_the_address_of_the_page_behind_a_proxy_is_given_to_the_provider(start, service):
    start(page_address="https://bench.example/lab")
    answer = service.client.get("/api/v1/session/oidc", follow_redirects=False)
    query = parse_qs(urlsplit(answer.headers["location"]).query)
    assert query["redirect_uri"] == ["https://bench.example/lab/api/v1/session/oidc/callback"]
