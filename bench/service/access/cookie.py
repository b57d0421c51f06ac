"""Cookie with the secret of a browser's session."""

from http.cookies import CookieError, SimpleCookie

from starlette.datastructures import Headers
from starlette.types import Scope


def get_cookie_name(scope: Scope) -> str:
    """Return the name of the cookie, one for each port, because the ports of a host share cookies."""
    server = scope.get("server") or ("", 0)
    return f"mrbench_session_{server[1] or 0}"


def read_cookie(scope: Scope) -> str | None:
    """Return the secret of the session that a request names, or None."""
    try:
        cookies = SimpleCookie(Headers(scope=scope).get("cookie", ""))
    except CookieError:
        return None
    found = cookies.get(get_cookie_name(scope))
    return found.value if found and found.value else None
