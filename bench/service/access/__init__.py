"""Access to the service: who sends a request, and what this person may do."""

from bench.service.access.authenticator import Authenticator, CredentialKind, PeopleStores
from bench.service.access.bench_token import PLAIN_TOKEN_FILE, TOKEN_FILE, Access, open_access, save_token
from bench.service.access.cookie import get_cookie_name, read_cookie
from bench.service.access.external_users import find_or_add_user
from bench.service.access.identity import Identity, compute_csrf
from bench.service.access.operation_rights import OPERATION_RIGHTS, OperationRights

__all__ = [
    "OPERATION_RIGHTS",
    "PLAIN_TOKEN_FILE",
    "TOKEN_FILE",
    "Access",
    "Authenticator",
    "CredentialKind",
    "Identity",
    "OperationRights",
    "PeopleStores",
    "compute_csrf",
    "find_or_add_user",
    "get_cookie_name",
    "open_access",
    "read_cookie",
    "save_token",
]
