"""Configuration of the sign-in by a provider, and names of its persons."""

import pytest

from bench.catalogue import check_user_name
from bench.errors import ConfigError, SecretFileError
from bench.oidc import Provider, load_oidc_config, normalise_name

COMPLETE = """
issuer = "https://login.example.org/realms/lab"
client_id = "mrbench"
client_secret_file = "oidc.secret"
name = "Laboratory account"

[roles]
lab-engineers = "engineer"
lab-heads = "administrator"
"""


@pytest.fixture
def write(tmp_path):
    """Return a function that writes both files, and returns the path of the configuration."""

    def write_files(text, secret="s3cret\n", mode=0o600):
        for name, content in (("oidc.toml", text), ("oidc.secret", secret)):
            path = tmp_path / name
            path.write_text(content)
            path.chmod(mode)
        return tmp_path / "oidc.toml"

    return write_files


def test_a_configuration_is_loaded_with_the_secret_beside_it(write):
    config = load_oidc_config(write(COMPLETE))
    assert config.client_secret.get_secret_value() == "s3cret"
    assert "s3cret" not in repr(config)
    assert config.find_role({"lab-engineers", "lab-heads", "x"}) == "administrator"
    assert config.find_role({"x"}) is None


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('client_id = "mrbench"\n', "", "client_id: is missing"),
        ('name = "Lab', 'nmae = "x"\nname = "Lab', "nmae: no such key"),
        ("https://login", "http://login", "issuer: http://login.example.org/realms/lab is not encrypted"),
        ("https://login.example.org/realms/lab", "login", "issuer: login is no address"),
        ("https://login", "https://user:password@login", "issuer: https://user:password@login"),
        ('client_secret_file = "oidc.secret"', "", "give client_secret or client_secret_file"),
        (
            'client_id = "mrbench"',
            'client_id = "m"\nclient_secret = "x"',
            "give client_secret or client_secret_file",
        ),
        ('client_id = "mrbench"', 'client_id = "m"\nscopes = ["profile"]', "openid is missing; add it"),
        ('"engineer"', '"boss"', "roles.lab-engineers: Input should be 'viewer'"),
        ('lab-engineers = "engineer"\nlab-heads = "administrator"', "", "nobody would have a role"),
        ("issuer =", "issuer", "not a TOML file"),
    ],
)
def test_a_fault_is_named_with_its_place(write, old, new, words):
    assert old in COMPLETE
    with pytest.raises(ConfigError) as error:
        load_oidc_config(write(COMPLETE.replace(old, new)))
    assert words in str(error.value)
    assert "oidc.toml: " in str(error.value)


def test_a_missing_configuration_is_named(tmp_path):
    with pytest.raises(ConfigError, match=r"oidc\.toml: cannot be read \(No such file"):
        load_oidc_config(tmp_path / "oidc.toml")


def test_a_secret_that_others_may_read_is_refused(write):
    with pytest.raises(SecretFileError, match=r"oidc\.secret: other users may read it"):
        load_oidc_config(write(COMPLETE, mode=0o644))
    inline = COMPLETE.replace('client_secret_file = "oidc.secret"', 'client_secret = "s3cret"')
    with pytest.raises(SecretFileError, match=r"oidc\.toml: other users may read it"):
        load_oidc_config(write(inline, mode=0o644))


def test_an_empty_secret_is_refused(write):
    with pytest.raises(ConfigError, match=r"oidc\.secret: is empty"):
        load_oidc_config(write(COMPLETE, secret=" \n"))


def test_a_certificate_that_cannot_be_used_is_named(write):
    config = load_oidc_config(write(COMPLETE.replace("name =", 'certificate = "missing.pem"\nname =')))
    with pytest.raises(ConfigError, match=r"missing\.pem: cannot be used as certificate"):
        Provider(config)


@pytest.mark.parametrize(
    ("name", "wanted"),
    [
        ("mcurie", "mcurie"),
        ("Marie.Curie@lab.example.org", "marie.curie"),
        ("  Irène Joliot  Curie ", "irene.joliot.curie"),
        ("Žižek_2", "zizek_2"),
    ],
)
def test_a_name_of_the_provider_becomes_a_user_name(name, wanted):
    assert check_user_name(normalise_name(name)) == wanted


@pytest.mark.parametrize("name", ["a/b", "Łukasz", "x", "7seven", "@lab.example.org", "mcurie\x00"])
def test_what_is_not_normalised_is_refused(name):
    with pytest.raises(ValueError, match="a user name has 2 to 40 characters"):
        check_user_name(normalise_name(name))
