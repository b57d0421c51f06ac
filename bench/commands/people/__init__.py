"""`mrbench user` and `mrbench token`: people and programs that may use a service."""

from bench.commands.people.token import token
from bench.commands.people.user import user

__all__ = ["token", "user"]
