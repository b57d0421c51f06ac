"""Evidence pages of the blind trial."""

__all__: list[str] = []
