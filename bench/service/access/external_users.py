"""Users for the persons of a provider."""

from typing import Any

from bench.catalogue import UserRow, UserStore, check_user_name
from bench.oidc import ExternalPerson, Fault, SignInError
from bench.people import Role
from bench.service.access.authenticator import PeopleStores


def find_or_add_user(person: ExternalPerson, stores: PeopleStores) -> UserRow:
    """Return the user of a person who has signed in at the provider, with the role of today.

    The first sign-in fixes the user name, because records carry it. A local user is never taken over. A person who
    has lost the role is signed out everywhere.

    Raises:
        SignInError: the person has no role or is disabled, or the name cannot be used.
    """
    row = stores.users.find_external(person.external_id)
    if person.role is None:
        if row is not None:
            stores.sessions.end_all("user", row.name)
        raise SignInError(Fault.ROLE_MISSING, f"{person.name}: is in no group that [roles] names")
    row = row or _add(person, person.role, stores.users)
    if row.disabled:
        raise SignInError(Fault.DISABLED, f"{row.name}: is disabled")
    return _update(row, {"role": person.role, "full_name": person.full_name}, stores.users)


def _add(person: ExternalPerson, role: Role, users: UserStore) -> UserRow:
    try:
        name = check_user_name(person.name)
    except ValueError as error:
        raise SignInError(Fault.NAME_UNUSABLE, f"{person.name}: {error}; see user_claim") from None
    row = UserRow(
        name=name,
        full_name=person.full_name,
        role=role,
        extra_rights=[],
        external_id=person.external_id,
        disabled=False,
    )
    # Two sign-ins of one person at the same time: the second one finds the user of the first.
    found = row if users.add(row) else users.find_external(person.external_id)
    if found is None:
        raise SignInError(Fault.NAME_TAKEN, f"{name}: is the name of another user; rename or remove that one")
    return found


def _update(row: UserRow, wanted: dict[str, Any], users: UserStore) -> UserRow:
    changes = {column: value for column, value in wanted.items() if getattr(row, column) != value}
    return (users.change(row.name, changes) if changes else None) or row
