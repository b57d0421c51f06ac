"""Configuration of the sign-in by a provider (``oidc.toml``)."""

import tomllib
from ipaddress import ip_address
from pathlib import Path
from typing import Annotated, Self, TypeAlias
from urllib.parse import urlsplit

from pydantic import AfterValidator, Field, SecretStr, ValidationError, model_validator

from bench.errors import ConfigError
from bench.people import ROLES, Role
from bench.private_file import check_private_file
from bench.validation import FrozenModel, describe_validation_error

_SECRET = "the secret that the provider gave for client_id"


def check_address(address: str) -> str:
    """Return an address unchanged if secrets may be sent to it.

    Raises:
        ValueError: it is neither https nor on the loopback interface, or has a fragment or a password.
    """
    parts = urlsplit(address)
    if not parts.hostname or parts.fragment or parts.username is not None:
        raise ValueError(f"{address} is no address of a provider; give https://HOST or https://HOST/PATH")
    if parts.scheme != "https" and not (parts.scheme == "http" and _is_loopback(parts.hostname)):
        raise ValueError(f"{address} is not encrypted; give an https address (http is for this machine only)")
    return address


Address: TypeAlias = Annotated[str, AfterValidator(check_address)]


class OidcConfig(FrozenModel):
    """Provider of sign-ins, and the roles of its groups."""

    issuer: Address = Field(description="address of the provider, exactly as in its tokens")
    client_id: str = Field(min_length=1, description="name of the service at the provider")
    client_secret: SecretStr | None = Field(default=None, description="secret of client_id")
    client_secret_file: Path | None = Field(
        default=None, description="file with the secret, beside this one or absolute; mode 0600"
    )
    name: str = Field(min_length=1, max_length=40, description="name of the provider on the button")
    scopes: tuple[str, ...] = Field(default=("openid", "profile"), description="requested scopes")
    user_claim: str = Field(default="preferred_username", min_length=1, description="claim of the user name")
    groups_claim: str = Field(default="groups", min_length=1, description="claim with the list of groups")
    roles: dict[str, Role] = Field(
        default_factory=dict, description="role of each group; of several the highest counts"
    )
    role_without_group: Role | None = Field(
        default=None, description="role of a person without such a group; by default the person is refused"
    )
    page_address: Address | None = Field(
        default=None, description="address of the page in browsers, if a proxy changes it"
    )
    certificate: Path | None = Field(
        default=None, description="certificates (PEM) by which the provider is checked; by default the system's"
    )

    @model_validator(mode="after")
    def _check_parts(self) -> Self:
        if (self.client_secret is None) == (self.client_secret_file is None):
            raise ValueError("give client_secret or client_secret_file, and not both")
        if "openid" not in self.scopes:
            raise ValueError(f"scopes {', '.join(self.scopes)}: openid is missing; add it")
        if not self.roles and self.role_without_group is None:
            raise ValueError("nobody would have a role; give roles of groups in [roles], or role_without_group")
        return self

    def find_role(self, groups: set[str]) -> Role | None:
        """Return the highest role of groups; None if the person is to be refused."""
        found = [role for group, role in self.roles.items() if group in groups]
        return max(found, key=ROLES.index) if found else self.role_without_group


def load_oidc_config(path: Path) -> OidcConfig:
    """Load the configuration of the provider, with the secret of its file.

    Raises:
        ConfigError: a file cannot be read or is not valid; the message names the position.
        SecretFileError: other users may read the secret.
    """
    try:
        config = OidcConfig.model_validate(tomllib.loads(path.read_text("utf-8")))
        if config.client_secret is not None:
            check_private_file(path, _SECRET)
        return _read_secret(config, path.parent)
    except OSError as error:
        raise ConfigError(f"{error.filename}: cannot be read ({error.strerror})") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: not a TOML file: {error}") from None
    except ValidationError as error:
        raise ConfigError(f"{path}: {describe_validation_error(error)}") from None


def _read_secret(config: OidcConfig, folder: Path) -> OidcConfig:
    """Return the configuration with its secret, and with a path of the certificate from the given folder."""
    changes: dict[str, object] = {"certificate": config.certificate and folder / config.certificate}
    if config.client_secret_file is not None:
        path = folder / config.client_secret_file
        check_private_file(path, _SECRET)
        secret = path.read_text("utf-8").strip()
        if not secret:
            raise ConfigError(f"{path}: is empty; it is {_SECRET}")
        changes["client_secret"] = SecretStr(secret)
    return config.model_copy(update=changes)


def _is_loopback(host: str) -> bool:
    try:
        return host == "localhost" or ip_address(host).is_loopback
    except ValueError:
        return False
