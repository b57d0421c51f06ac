"""Blind trial of the diagnosis: sealed scenarios are recorded, diagnosed, unsealed and scored."""

__all__: list[str] = []
