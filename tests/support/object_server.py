"""An S3-compatible server as a process on loopback; its objects are in its memory and end with it."""

import os
import signal
import socket
import subprocess
import sys
import time
from urllib.request import Request, urlopen
from xml.etree import ElementTree

BUCKET = "laboratory"
DEADLINE = 60.0
"""[s] Time for the start of the server, and for one answer."""
SECRETS = {"AWS_ACCESS_KEY_ID": "hidden-key", "AWS_SECRET_ACCESS_KEY": "hidden-secret"}

SIGNATURE = "AWS4-HMAC-SHA256 Credential=test/20260101/us-east-1/s3/aws4_request"
"""The server demands a signature and does not check it."""


class ObjectServer:
    """Server with one bucket, always at the same port."""

    def __init__(self, folder):
        with socket.socket() as taken:
            taken.bind(("127.0.0.1", 0))
            self.port = taken.getsockname()[1]
        self.endpoint, self.log = f"http://127.0.0.1:{self.port}", folder / "objects.log"
        self.environment = os.environ | SECRETS | {"MRBENCH_NICE": "0", "AWS_ENDPOINT_URL": self.endpoint}
        self.process = None
        self.start()

    def start(self):
        """Start the server with an empty bucket."""
        words = [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(self.port)]
        with self.log.open("a") as log:
            self.process = subprocess.Popen(words, stdout=log, stderr=subprocess.STDOUT)
        deadline = time.monotonic() + DEADLINE
        while not self._is_ready():
            assert self.process.poll() is None, self.log.read_text()
            assert time.monotonic() < deadline, self.log.read_text()
            time.sleep(0.05)
        self._request("", "PUT")

    def stop(self):
        if self.process is not None:
            self.process.send_signal(signal.SIGCONT)
            self.process.kill()
            self.process.wait(DEADLINE)
            self.process = None

    def pause(self):
        """Make the server silent: connections are accepted, and nothing is answered."""
        self.process.send_signal(signal.SIGSTOP)

    def resume(self):
        self.process.send_signal(signal.SIGCONT)

    def list_objects(self):
        """Return the names of all objects."""
        listing = ElementTree.fromstring(self._request("?list-type=2"))
        return [item.text for item in listing.iter() if item.tag.endswith("}Key")]

    def read(self, name):
        return self._request(f"/{name}")

    def write(self, name, content):
        self._request(f"/{name}", "PUT", content)

    def _is_ready(self):
        try:
            socket.create_connection(("127.0.0.1", self.port), 1).close()
        except OSError:
            return False
        return True

    def _request(self, path, method="GET", content=None):
        request = Request(f"{self.endpoint}/{BUCKET}{path}", content, {"Authorization": SIGNATURE}, method=method)
        with urlopen(request, timeout=DEADLINE) as reply:
            return reply.read()
