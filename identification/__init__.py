"""Identification of dampers from recordings. The face stays empty: its parts differ in what they load."""

__all__: list[str] = []
