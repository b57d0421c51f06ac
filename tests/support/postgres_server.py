"""A private PostgreSQL server for tests: in a temporary folder, on a Unix socket, without waiting for the disk."""

import os
import pwd
import shutil
import signal
import subprocess
import tempfile
import time
from pathlib import Path

import pytest
from sqlalchemy import create_engine, make_url, text
from sqlalchemy.exc import OperationalError

from bench.catalogue import open_database

ACCOUNT = "postgres"
"""Account under which root starts the server, which refuses root."""
DEADLINE = 30.0
"""[s] Time for start or end of the server."""
SETTINGS = {
    "fsync": "off",
    "synchronous_commit": "off",
    "full_page_writes": "off",
    "listen_addresses": "",
    "shared_buffers": "64MB",
    "max_connections": "100",
    "autovacuum": "off",
    "log_min_messages": "fatal",
}
EMPTY = """
DO $$ DECLARE name text; BEGIN
    SET session_replication_role = replica; -- foreign keys are not checked meanwhile
    FOR name IN SELECT tablename FROM pg_tables WHERE schemaname = 'public' AND tablename <> 'alembic_version' LOOP
        EXECUTE format('DELETE FROM %I', name);
    END LOOP;
    FOR name IN SELECT sequencename FROM pg_sequences LOOP
        EXECUTE format('ALTER SEQUENCE %I RESTART', name);
    END LOOP;
END $$
"""


def find_programs():
    """Return the folder of the newest server programs, or None."""
    folders = sorted(Path("/usr/lib/postgresql").glob("*/bin"), key=lambda path: int(path.parent.name))
    found = [folder for folder in folders if (folder / "initdb").is_file()]
    if found:
        return found[-1]
    installed = shutil.which("initdb")
    return Path(installed).parent if installed else None


class PostgresServer:
    """Server that a test can stop and start; each catalogue is a database of its own."""

    def __init__(self, programs):
        self.programs = programs
        self.folder = Path(tempfile.mkdtemp(prefix="mrbench-postgres-"))
        self.process = None
        self.made, self.catalogue = 0, None
        self.drop_to_account = []
        if os.geteuid() == 0:
            account = pwd.getpwnam(ACCOUNT)
            os.chown(self.folder, account.pw_uid, account.pw_gid)
            self.drop_to_account = ["setpriv", f"--reuid={ACCOUNT}", f"--regid={ACCOUNT}", "--clear-groups"]
        words = ["-D", self.folder / "data", "-U", "mrbench", "-A", "trust", "--no-sync", "--encoding=UTF8"]
        self._call("initdb", *words, "--locale=C.UTF-8")

    def start(self):
        options = [word for name, value in SETTINGS.items() for word in ("-c", f"{name}={value}")]
        words = [self.programs / "postgres", "-D", self.folder / "data", "-k", self.folder, *options]
        with (self.folder / "server.log").open("a") as log:
            self.process = subprocess.Popen(
                [*self.drop_to_account, *words], stdout=log, stderr=subprocess.STDOUT, cwd="/"
            )
        deadline = time.monotonic() + DEADLINE
        while not self._is_ready():
            assert time.monotonic() < deadline, (self.folder / "server.log").read_text()
            time.sleep(0.05)

    def stop(self):
        """End the server at once; its connections break."""
        if self.process is not None:
            self.process.send_signal(signal.SIGINT)
            self.process.wait(DEADLINE)
            self.process = None

    def remove(self):
        self.stop()
        shutil.rmtree(self.folder, ignore_errors=True)

    def make_url(self, database):
        return f"postgresql://mrbench:secret-word@/{database}?host={self.folder}"

    def make_catalogue(self):
        """Return the URL of an empty catalogue, always in the same database, because a new one costs a second."""
        if self.catalogue is None:
            self.catalogue = self.make_database()
            open_database(self.catalogue).dispose()
        else:
            self.disconnect(self.catalogue)
            self.execute(EMPTY, self.catalogue)
        return self.catalogue

    def make_database(self):
        """Return the URL of a new database without tables."""
        self.made += 1
        self.execute(f"CREATE DATABASE database_{self.made}")
        return self.make_url(f"database_{self.made}")

    def allow_connections(self, url, allowed):
        """Permit connections to a database, or end all and refuse new ones, as an outage does."""
        self.execute(f"ALTER DATABASE {make_url(url).database} ALLOW_CONNECTIONS {allowed}")
        if not allowed:
            self.disconnect(url)

    def disconnect(self, url):
        """End all connections to a database."""
        database = make_url(url).database
        self.execute(f"SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = '{database}'")

    def execute(self, statement, url=None):
        """Execute a statement as the owner of the server, and return its rows."""
        address = make_url(url or self.make_url("postgres")).set(drivername="postgresql+psycopg")
        engine = create_engine(address, isolation_level="AUTOCOMMIT")
        try:
            with engine.connect() as connection:
                found = connection.execute(text(statement))
                return found.all() if found.returns_rows else []
        finally:
            engine.dispose()

    def _is_ready(self):
        try:
            return bool(self.execute("SELECT 1"))
        except OperationalError:
            return False

    def _call(self, program, *words):
        subprocess.run(
            [*self.drop_to_account, self.programs / program, *words], check=True, capture_output=True, cwd="/"
        )


def start_server():
    """Return a running server; skip the test where none is installed."""
    programs = find_programs()
    if programs is None:
        pytest.skip("PostgreSQL is not installed; run `apt-get install postgresql`")
    pytest.importorskip("psycopg", reason="psycopg is not installed; run `pip install 'mrbench[postgres]'`")
    server = PostgresServer(programs)
    try:
        server.start()
    except BaseException:
        server.remove()
        raise
    return server
