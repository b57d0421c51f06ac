"""People who use the service: roles and rights, passwords, failed attempts, and codes for another device."""

from bench.people.attempts import AttemptCounter
from bench.people.passwords import check_password, hash_password, is_password
from bench.people.random_secrets import compute_sha256, new_secret
from bench.people.roles import RIGHTS, ROLES, Right, Role, compute_rights, find_roles
from bench.people.sign_in_codes import CODE_LIFETIME, SignInCode, SignInCodes

__all__ = [
    "CODE_LIFETIME",
    "RIGHTS",
    "ROLES",
    "AttemptCounter",
    "Right",
    "Role",
    "SignInCode",
    "SignInCodes",
    "check_password",
    "compute_rights",
    "compute_sha256",
    "find_roles",
    "hash_password",
    "is_password",
    "new_secret",
]
