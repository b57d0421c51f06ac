"""Quality of the tests, and documents of two versions compared."""

__all__: list[str] = []
