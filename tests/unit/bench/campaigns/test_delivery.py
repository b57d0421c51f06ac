"""Delivery by webhook and e-mail to servers on loopback, and what a person reads after each kind of failure."""

import time

import pytest

from bench.campaigns import CampaignError, delivery
from bench.campaigns.delivery import deliver, name_recipient
from bench.campaigns.document import Mail, Webhook
from bench.campaigns.notifications import make_test_content, send_all
from tests.support.message_servers import (
    find_closed_port,
    make_server_context,
    serve_mail,
    serve_silence,
    serve_webhook,
)

CONTENT = {"campaign": "night-1", "id": 3, "kind": "person_needed", "text": "Mount MR-0043", "status": "running"}
MAIL = Mail(mailto="night@example.org")


@pytest.fixture
def mail_server(monkeypatch):
    """Name a mail server in the environment."""
    return lambda address: monkeypatch.setenv("MRBENCH_SMTP", address)


def fail(recipient):
    with pytest.raises(CampaignError) as caught:
        deliver(recipient, CONTENT)
    return str(caught.value)


def test_a_webhook_receives_the_message_as_json():
    with serve_webhook() as (address, received):
        deliver(Webhook(webhook=address), CONTENT)
    assert received == [CONTENT]


def test_user_and_password_of_a_webhook_are_sent():
    with serve_webhook(user="Basic YmVuY2g6cGFzcyB3b3Jk") as (address, _):
        assert fail(Webhook(webhook=address)).endswith("it answered 401 Unauthorized")
        deliver(Webhook(webhook=address.replace("://", "://bench:pass%20word@")), CONTENT)


@pytest.mark.parametrize(
    ("status", "reason"), [(500, "it answered 500 Internal Server Error"), (302, "it answered 302 Found")]
)
def test_an_error_or_a_redirect_is_no_delivery(status, reason):
    with serve_webhook([status]) as (address, received):
        assert fail(Webhook(webhook=address)).endswith(f"was not notified: {reason}")
    assert len(received) == 1  # the redirect was not followed


def test_a_refused_connection_names_the_host_and_no_secret_of_the_address():
    port = find_closed_port()
    text = fail(Webhook(webhook=f"http://user:key@127.0.0.1:{port}/services/T0KEN"))
    assert f"the webhook at 127.0.0.1:{port} was not notified: the connection was refused" in text
    assert "key" not in text
    assert "T0KEN" not in text


def test_a_server_that_never_answers_ends_at_the_time_limit(monkeypatch, mail_server):
    monkeypatch.setattr(delivery, "TIMEOUT", 0.3)
    began = time.monotonic()
    with serve_silence() as port:
        mail_server(f"smtp://127.0.0.1:{port}")
        for recipient in (Webhook(webhook=f"http://127.0.0.1:{port}/"), MAIL):
            assert fail(recipient).endswith("no answer within 0.3 s")
    assert time.monotonic() - began < 5


def test_a_wrong_certificate_is_refused_and_one_of_a_named_authority_accepted(tmp_path, monkeypatch, mail_server):
    context, certificate = make_server_context(tmp_path)
    with serve_webhook(context=context) as (address, received), serve_mail(tls=context) as (port, box):
        mail_server(f"smtps://127.0.0.1:{port}")
        for recipient in (Webhook(webhook=address), MAIL):
            assert "its certificate is not accepted, self-signed certificate" in fail(recipient)
        assert (received, box.mails) == ([], [])
        monkeypatch.setenv("SSL_CERT_FILE", str(certificate))
        for recipient in (Webhook(webhook=address), MAIL):
            deliver(recipient, CONTENT)
    assert (len(received), len(box.mails)) == (1, 1)


def test_an_email_says_what_has_happened(mail_server):
    with serve_mail() as (port, box):
        mail_server(f"smtp://127.0.0.1:{port}")
        deliver(MAIL, CONTENT)
    ((recipients, text),) = box.mails
    assert recipients == ["night@example.org"]
    for part in ("Subject: mrbench: campaign night-1: person needed", "Date: ", "text: Mount MR-0043"):
        assert part in text


def test_user_and_password_are_sent_by_tls(tmp_path, monkeypatch, mail_server):
    context, certificate = make_server_context(tmp_path)
    monkeypatch.setenv("SSL_CERT_FILE", str(certificate))
    with serve_mail(start_tls=context) as (port, box):
        mail_server(f"smtp://bench%40lab:pass%20word@127.0.0.1:{port}")
        deliver(MAIL, CONTENT)
        mail_server(f"smtp://bench%40lab:other@127.0.0.1:{port}")
        assert "has refused user and password" in fail(MAIL)
    assert (set(box.users), len(box.mails)) == ({"bench@lab"}, 1)


def test_no_password_is_sent_to_another_machine_without_tls(monkeypatch, mail_server):
    monkeypatch.setattr(delivery, "_LOOPBACK_NAMES", ())
    with serve_mail() as (port, box):
        mail_server(f"smtp://bench:secret@127.0.0.1:{port}")
        assert "no password was sent; use smtps://" in fail(MAIL)
    assert (box.users, box.mails) == ([], [])


def test_a_refused_mailbox_names_the_answer_of_the_server(mail_server):
    with serve_mail() as (port, box):
        box.refused = ("night@example.org",)
        mail_server(f"smtp://127.0.0.1:{port}")
        assert "night@example.org was not notified: the mail server answered 550 no such mailbox" in fail(MAIL)


@pytest.mark.parametrize(
    "address", ["", "smtp://", "mail.example.org", "https://mail.example.org", "smtp://user:se/cret@host:25"]
)
def test_an_unusable_address_of_the_mail_server_is_told_without_its_password(address, mail_server):
    mail_server(address)
    text = fail(MAIL)
    assert "set MRBENCH_SMTP=smtp://HOST:PORT" in text
    assert "cret" not in text


def test_a_test_message_reaches_one_recipient_though_another_fails():
    closed = Webhook(webhook=f"http://127.0.0.1:{find_closed_port()}/")
    with serve_webhook() as (address, received):
        result = send_all([closed, Webhook(webhook=address)], make_test_content("night"))
    assert received[0]["kind"] == "test"
    assert result.count("was not notified") == 1
    assert name_recipient(closed) in result
