"""Tests of the transfer of a catalogue to another database."""
