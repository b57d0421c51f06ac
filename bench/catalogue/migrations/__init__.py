"""How the tables came to be, step by step; run by Alembic whenever a catalogue is opened."""
