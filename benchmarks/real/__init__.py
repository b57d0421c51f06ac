"""Evidence pages on recordings of real dampers and on the paper's figures."""

__all__: list[str] = []
