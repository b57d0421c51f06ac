"""Notifications of a campaign by webhook and e-mail: on its end, on a stop, and when a person is needed.

``MRBENCH_SMTP`` names the mail server as ``smtp://USER:PASSWORD@HOST:PORT``, or ``smtps://`` for TLS
from the start. ``MRBENCH_SMTP_FROM`` is the sender.
"""

import json
import os
import smtplib
import ssl
from collections.abc import Sequence
from email.message import EmailMessage
from http.client import HTTPException
from typing import Any
from urllib.error import URLError
from urllib.parse import unquote, urlsplit
from urllib.request import Request, urlopen

from bench.campaigns.document import CampaignError, Mail, Recipient, Webhook
from bench.campaigns.store import CampaignStore

SERVER_VARIABLE, SENDER_VARIABLE = "MRBENCH_SMTP", "MRBENCH_SMTP_FROM"
_TIMEOUT = 10.0
"""[s] Time limit of one message."""


def send_due(store: CampaignStore, campaign_id: str) -> None:
    """Send the messages of a campaign that are due; a failure is recorded and does not stop the campaign."""
    due = store.table.list_due(campaign_id)
    if not due:
        return
    campaign = store.get(campaign_id)
    for event in due:
        content = {
            "campaign": campaign_id,
            "kind": event.kind,
            "text": event.text,
            "at": event.at.isoformat(),
            "status": campaign.state.status,
        }
        store.table.set_notification(event.id, send_all(campaign.state.campaign.notify, content))


def send_all(recipients: Sequence[Recipient], content: dict[str, Any]) -> str:
    """Send one message to all recipients; return `sent`, or the reasons of failures."""
    failures = []
    for recipient in recipients:
        try:
            send_message(recipient, content)
        except CampaignError as error:
            failures.append(str(error))
    return "; ".join(failures) or "sent"


def make_test_content(name: str) -> dict[str, Any]:
    """Return the content of a test message."""
    return {"campaign": name, "kind": "test", "text": f"test message of campaign {name}; nothing has happened"}


def send_message(recipient: Recipient, content: dict[str, Any]) -> None:
    """Send one message.

    Raises:
        CampaignError: it cannot be sent; the message names the recipient and the reason.
    """
    try:
        if isinstance(recipient, Webhook):
            _post(recipient.webhook, content)
        else:
            _mail(recipient, content)
    except (URLError, HTTPException, smtplib.SMTPException, OSError, ValueError) as error:
        name = recipient.webhook if isinstance(recipient, Webhook) else recipient.mailto
        raise CampaignError(f"{name} was not notified: {error}") from None


def _post(address: str, content: dict[str, Any]) -> None:
    request = Request(address, json.dumps(content).encode(), {"Content-Type": "application/json"}, method="POST")
    with urlopen(request, timeout=_TIMEOUT) as reply:
        reply.read()


def _mail(recipient: Mail, content: dict[str, Any]) -> None:
    server = urlsplit(os.environ.get(SERVER_VARIABLE, ""))
    if not server.hostname:
        raise CampaignError(
            f"{recipient.mailto} was not notified: no mail server; set {SERVER_VARIABLE}=smtp://HOST:PORT"
        )
    message = EmailMessage()
    message["Subject"] = f"mrbench: campaign {content['campaign']}: {content['kind'].replace('_', ' ')}"
    message["From"] = os.environ.get(SENDER_VARIABLE, f"mrbench@{server.hostname}")
    message["To"] = recipient.mailto
    message.set_content("\n".join(f"{key}: {value}" for key, value in content.items()))
    is_tls = server.scheme == "smtps"
    connect = smtplib.SMTP_SSL if is_tls else smtplib.SMTP
    with connect(server.hostname, server.port or (465 if is_tls else 25), timeout=_TIMEOUT) as session:
        session.ehlo()
        if not is_tls and session.has_extn("starttls"):
            session.starttls(context=ssl.create_default_context())
        if server.username:
            session.login(unquote(server.username), unquote(server.password or ""))
        session.send_message(message)
