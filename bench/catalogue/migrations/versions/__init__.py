"""One migration per file, named by its number."""

__all__: list[str] = []
