"""Transfer of a catalogue to another database: from SQLite to PostgreSQL, back, or to another server."""

from bench.catalogue.transfer.transfer import FILE_TARGET, Transferred, transfer_catalogue

__all__ = ["FILE_TARGET", "Transferred", "transfer_catalogue"]
