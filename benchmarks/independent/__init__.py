"""Diagnoses of recordings from a simulator that shares no equation and no code with the product."""

__all__: list[str] = []
