"""Commands of the command line; each module is imported only when its command is called."""

__all__: list[str] = []
