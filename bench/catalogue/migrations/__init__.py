"""Migrations of the catalogue's tables, run by Alembic whenever a catalogue is opened."""

__all__: list[str] = []
