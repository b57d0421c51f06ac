"""Servers on loopback that receive the messages of campaigns, and one that never answers."""

import contextlib
import ipaddress
import json
import socket
import ssl
import threading
from datetime import UTC, datetime, timedelta
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

from aiosmtpd.controller import Controller
from aiosmtpd.smtp import AuthResult
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec


def make_server_context(folder):
    """Return the TLS context of a server at 127.0.0.1, and the file of its self-signed certificate."""
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, "127.0.0.1")])
    now = datetime.now(UTC)
    certificate = (
        x509.CertificateBuilder(name, name, key.public_key(), 1, now - timedelta(1), now + timedelta(1))
        .add_extension(x509.SubjectAlternativeName([x509.IPAddress(ipaddress.ip_address("127.0.0.1"))]), False)
        .sign(key, hashes.SHA256())
    )
    pem = folder / "server.pem"
    encoded = certificate.public_bytes(serialization.Encoding.PEM)
    secret = key.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    )
    pem.write_bytes(encoded)
    pair = folder / "pair.pem"
    pair.write_bytes(encoded + secret)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(pair)
    return context, pem


class Webhook(BaseHTTPRequestHandler):
    """Keeps the JSON of each POST; answers with the statuses of the server, then with 204."""

    def do_POST(self):
        self.server.received.append(json.loads(self.rfile.read(int(self.headers["Content-Length"]))))
        status = self.server.statuses.pop(0) if self.server.statuses else 204
        if self.server.user and self.headers["Authorization"] != self.server.user:
            status = 401
        self.send_response(status)
        if status == 302:
            self.send_header("Location", "/login")
        self.end_headers()

    do_GET = do_POST  # noqa: N815 - a name of the library

    def log_message(self, *_):
        pass


class QuietServer(ThreadingHTTPServer):
    """A client that refuses the certificate is no event."""

    def handle_error(self, request, client_address):
        pass


@contextlib.contextmanager
def serve_webhook(statuses=(), context=None, user=""):
    """Serve a webhook that expects a header of authorisation or none; yields its address and what it receives."""
    server = QuietServer(("127.0.0.1", 0), Webhook)
    server.statuses, server.received, server.user = list(statuses), [], user
    if context is not None:
        server.socket = context.wrap_socket(server.socket, server_side=True)
    thread = threading.Thread(target=server.serve_forever, args=(0.01,))
    thread.start()
    try:
        yield f"{'https' if context else 'http'}://127.0.0.1:{server.server_port}/hook", server.received
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


class Mailbox:
    """Keeps each e-mail; refuses the addresses in `refused`."""

    def __init__(self):
        self.mails, self.users, self.refused = [], [], ()

    async def handle_RCPT(self, server, session, envelope, address, options):  # noqa: N802 - a name of the library
        if address in self.refused:
            return "550 no such mailbox"
        envelope.rcpt_tos.append(address)
        return "250 OK"

    async def handle_DATA(self, server, session, envelope):  # noqa: N802
        self.mails.append((envelope.rcpt_tos, envelope.content.decode()))
        return "250 OK"

    def authenticate(self, server, session, envelope, mechanism, data):
        self.users.append(data.login.decode())
        return AuthResult(success=data.password == b"pass word", handled=False)


@contextlib.contextmanager
def serve_mail(start_tls=None, tls=None):
    """Serve SMTP, with STARTTLS or with TLS from the start; yields port and mailbox."""
    box = Mailbox()
    controller = Controller(
        box, "127.0.0.1", 0, ready_timeout=10, ssl_context=tls, tls_context=start_tls,
        authenticator=box.authenticate, auth_require_tls=False,
    )  # fmt: skip
    with contextlib.closing(socket.create_server(("127.0.0.1", 0))) as free:
        controller.port = free.getsockname()[1]
    controller.start()
    try:
        yield controller.port, box
    finally:
        controller.stop()


@contextlib.contextmanager
def serve_silence():
    """Accept connections and answer nothing; yields the port."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        yield listener.getsockname()[1]


def find_closed_port():
    """Return a port at which nothing listens."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return listener.getsockname()[1]
