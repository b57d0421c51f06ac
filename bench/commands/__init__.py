"""Commands of the bench, one module each. Heavy imports happen inside the functions, so that `--help` is fast."""

__all__: list[str] = []
