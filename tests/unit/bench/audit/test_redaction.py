"""Values in the audit trail: no secrets, nothing large."""

import hashlib
import json

import pytest

from bench.audit import redact


@pytest.mark.parametrize(
    "name",
    [
        "password",
        "current_password",
        "token",
        "code",
        "csrf",
        "Secret",
        "smtp_password",
        "api_key",
        "Authorization",
    ],
)
def test_secrets_are_hidden_at_any_depth(name):
    value = redact({"users": [{"name": "ada", name: "hunter2hunter2"}]})
    assert value == {"users": [{"name": "ada", name: "…"}]}


def test_absent_secrets_and_other_values_stay():
    value = {"password": None, "has_password": True, "name": "ada", "n": 1, "x": 0.5, "tags": ["a", None, False]}
    assert redact(value) == value


def test_the_path_of_a_webhook_is_hidden():
    value = redact({"notify": [{"webhook": "https://user:pass@chat.example/hooks/T0/secret?key=1"}]})
    assert value == {"notify": [{"webhook": "https://chat.example/…"}]}


def test_large_values_become_size_and_hash():
    large = {"name": "sweep", "rows": list(range(5000))}
    encoded = json.dumps(large, sort_keys=True, separators=(",", ":")).encode()
    expected = {"bytes": len(encoded), "sha256": hashlib.sha256(encoded).hexdigest(), "name": "sweep"}
    assert redact(large) == expected
    text = redact({"note": "x" * 5000})["note"]
    assert text.startswith("x" * 200 + "…")
    assert hashlib.sha256(b"x" * 5000).hexdigest() in text
    assert "5000 characters" in text


def test_everything_becomes_plain_json():
    deep = []
    for _ in range(100):
        deep = [deep]
    value = redact({"nan": float("nan"), "big": 10**30, "half": "\ud800", "deep": deep, 5: (1, 2), "raw": b"x"})
    assert (value["nan"], value["big"], value["half"], value["5"]) == ("nan", str(10**30), "\\ud800", [1, 2])
    json.dumps(value, allow_nan=False).encode()
