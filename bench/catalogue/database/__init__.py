"""Database of a catalogue: its address, its connections, and what differs between SQLite and PostgreSQL."""

from bench.catalogue.database.address import (
    ADDRESS_FILE,
    CATALOGUE_FILE,
    POSTGRES,
    SQLITE,
    describe_address,
    find_catalogue,
    has_catalogue,
    keep_address,
    locate_catalogue,
    make_sqlite_url,
    parse_address,
    parse_server_address,
    write_address,
)
from bench.catalogue.database.change_counter import ChangeCounter
from bench.catalogue.database.engine import (
    explain_failed_opening,
    get_reason,
    make_engine,
    migrate,
    open_database,
    report_outages,
)
from bench.catalogue.database.postgres_tools import dump_database, restore_database
from bench.catalogue.database.writing import begin_write

__all__ = [
    "ADDRESS_FILE",
    "CATALOGUE_FILE",
    "POSTGRES",
    "SQLITE",
    "ChangeCounter",
    "begin_write",
    "describe_address",
    "dump_database",
    "explain_failed_opening",
    "find_catalogue",
    "get_reason",
    "has_catalogue",
    "keep_address",
    "locate_catalogue",
    "make_engine",
    "make_sqlite_url",
    "migrate",
    "open_database",
    "parse_address",
    "parse_server_address",
    "report_outages",
    "restore_database",
    "write_address",
]
