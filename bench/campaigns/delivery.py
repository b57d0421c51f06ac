"""Delivery of one message to one recipient, by webhook or e-mail.

``MRBENCH_SMTP`` names the mail server as ``smtp://USER:PASSWORD@HOST:PORT``, or ``smtps://`` for TLS
from the start. ``MRBENCH_SMTP_FROM`` is the sender. Certificates are checked, by ``SSL_CERT_FILE`` if it is
set. A password is sent only by TLS, or to a mail server on this machine.
"""

import json
import os
import smtplib
import ssl
from base64 import b64encode
from email.message import EmailMessage
from email.utils import formatdate, make_msgid
from http.client import HTTPException
from typing import Any, NamedTuple
from urllib.error import HTTPError, URLError
from urllib.parse import unquote, urlsplit, urlunsplit
from urllib.request import HTTPRedirectHandler, HTTPSHandler, Request, build_opener

from pydantic import TypeAdapter

from bench.campaigns.document import CampaignError, Mail, Recipient, Webhook
from bench.threads import run_within

SERVER_VARIABLE, SENDER_VARIABLE = "MRBENCH_SMTP", "MRBENCH_SMTP_FROM"
TIMEOUT = 10.0
"""[s] Time limit of one attempt."""
_THREAD = "campaign-message"
"""Name of the thread of an attempt."""
RECIPIENT: TypeAdapter[Recipient] = TypeAdapter(Recipient)
"""Reads a recipient as the catalogue has it."""
_PORTS = {"smtp": 25, "smtps": 465}
_LOOPBACK_NAMES = ("127.0.0.1", "localhost", "::1")


class MailServer(NamedTuple):
    """Mail server with its user."""

    host: str
    port: int
    has_tls: bool
    """True for TLS from the start."""
    user: str
    password: str


def deliver(recipient: Recipient, content: dict[str, Any]) -> None:
    """Deliver one message within the time limit.

    Raises:
        CampaignError: it is not delivered; the message names the recipient and the reason.
    """
    try:
        if isinstance(recipient, Webhook):
            run_within(TIMEOUT, lambda: _post(recipient.webhook, content), _THREAD)
        else:
            server = read_mail_server()
            run_within(TIMEOUT, lambda: _mail(server, recipient, content), _THREAD)
    except Exception as error:  # also an error of a library that it does not document must stop nothing
        raise CampaignError(f"{name_recipient(recipient)} was not notified: {_describe(error)}") from None


def name_recipient(recipient: Recipient) -> str:
    """Return a recipient for a person; of a webhook only the host, because its address may contain a secret."""
    if isinstance(recipient, Mail):
        return recipient.mailto
    return f"the webhook at {urlsplit(recipient.webhook).netloc.rpartition('@')[2]}"


def read_mail_server() -> MailServer:
    """Return the mail server of the environment.

    Raises:
        CampaignError: there is none, or its address is invalid; the message does not repeat it.
    """
    form = f"set {SERVER_VARIABLE}=smtp://HOST:PORT or smtps://USER:PASSWORD@HOST:PORT"
    address = os.environ.get(SERVER_VARIABLE, "")
    if not address:
        raise CampaignError(f"there is no mail server; {form}")
    try:
        parts = urlsplit(address)
        port = parts.port or _PORTS[parts.scheme]
    except (ValueError, KeyError):
        raise CampaignError(f"the address of the mail server is invalid; {form}, marks as %XX") from None
    user, password = unquote(parts.username or ""), unquote(parts.password or "")
    if not parts.hostname:
        raise CampaignError(f"the address of the mail server has no host; {form}")
    return MailServer(parts.hostname, port, parts.scheme == "smtps", user, password)


class _RefusedRedirect(HTTPRedirectHandler):
    """Refusal of redirects, which would turn the POST into a GET and lose the message without an error."""

    def redirect_request(self, *_: Any, **__: Any) -> None:
        return


def _post(address: str, content: dict[str, Any]) -> None:
    opener = build_opener(_RefusedRedirect, HTTPSHandler(context=ssl.create_default_context()))
    try:
        opener.open(_make_request(address, content), timeout=TIMEOUT).close()
    except HTTPError as error:
        error.close()
        raise


def _make_request(address: str, content: dict[str, Any]) -> Request:
    """Return the POST; user and password of the address become a header, because the library takes no others."""
    parts = urlsplit(address)
    plain = urlunsplit(parts._replace(netloc=parts.netloc.rpartition("@")[2]))
    request = Request(plain, json.dumps(content).encode(), {"Content-Type": "application/json"}, method="POST")
    if parts.username:
        pair = f"{unquote(parts.username)}:{unquote(parts.password or '')}"
        request.add_header("Authorization", f"Basic {b64encode(pair.encode()).decode()}")
    return request


def _mail(server: MailServer, recipient: Mail, content: dict[str, Any]) -> None:
    context = ssl.create_default_context()
    with _connect(server, context) as session:
        session.ehlo()
        has_tls = server.has_tls
        if not has_tls and session.has_extn("starttls"):
            session.starttls(context=context)
            has_tls = True
        if server.user:
            if not has_tls and server.host not in _LOOPBACK_NAMES:
                raise CampaignError("the mail server offers no TLS, so that no password was sent; use smtps://")
            session.login(server.user, server.password)
        session.send_message(_make_mail(server, recipient, content))


def _connect(server: MailServer, context: ssl.SSLContext) -> smtplib.SMTP:
    if server.has_tls:
        return smtplib.SMTP_SSL(server.host, server.port, timeout=TIMEOUT, context=context)
    return smtplib.SMTP(server.host, server.port, timeout=TIMEOUT)


def _make_mail(server: MailServer, recipient: Mail, content: dict[str, Any]) -> EmailMessage:
    message = EmailMessage()
    message["Subject"] = f"mrbench: campaign {content['campaign']}: {content['kind'].replace('_', ' ')}"
    message["From"] = os.environ.get(SENDER_VARIABLE, f"mrbench@{server.host}")
    message["To"] = recipient.mailto
    message["Date"] = formatdate()
    message["Message-ID"] = make_msgid(domain="mrbench")
    message.set_content("\n".join(f"{key}: {value}" for key, value in content.items()))
    return message


def _describe(error: Exception) -> str:
    """Return the reason of a failure as text, with what to do."""
    if isinstance(error, HTTPError):
        return f"it answered {error.code} {error.reason}"
    if isinstance(error, URLError) and isinstance(error.reason, Exception):
        return _describe(error.reason)
    if isinstance(error, ssl.SSLCertVerificationError):
        return f"its certificate is not accepted, {error.verify_message}; name its authority in SSL_CERT_FILE"
    if isinstance(error, TimeoutError):
        return f"no answer within {TIMEOUT:g} s"
    if isinstance(error, ConnectionRefusedError):
        return "the connection was refused; is its server running, and is the port right?"
    if isinstance(error, smtplib.SMTPAuthenticationError):
        return f"the mail server has refused user and password of {SERVER_VARIABLE}"
    if isinstance(error, smtplib.SMTPResponseException):
        return f"the mail server answered {error.smtp_code} {_decode(error.smtp_error)}"
    if isinstance(error, smtplib.SMTPRecipientsRefused):
        code, text = next(iter(error.recipients.values()))
        return f"the mail server answered {code} {_decode(text)}"
    if isinstance(error, HTTPException | CampaignError | OSError | ValueError | smtplib.SMTPException):
        return str(error) or type(error).__name__
    return repr(error)


def _decode(text: bytes | str) -> str:
    return text.decode(errors="replace") if isinstance(text, bytes) else text
