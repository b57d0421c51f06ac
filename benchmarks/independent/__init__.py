"""Diagnoses of recordings from a simulator that shares no code with the product's, only the law of the damper."""

__all__: list[str] = []
