"""Interlocks: what must not happen, and what is done about it."""
