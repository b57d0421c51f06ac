"""`mrbench certificate`: certificates in the catalogue of a data folder."""

import json

import pytest
from typer import BadParameter

from bench.calibration import CertificateError
from bench.catalogue import open_catalogue
from bench.catalogue.errors import CatalogueError
from bench.commands.certificate import certificate
from bench.commands.certificate.dispatch import Action
from tests.support.certificates import make_certificate, shift


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "force.json"
    path.write_text(json.dumps(make_certificate()))
    return path


def test_a_certificate_is_added_listed_and_withdrawn(path, tmp_path, capsys):
    data = tmp_path / "runs"
    certificate(Action.ADD, str(path), data=data, operator="M. Curie")
    number = capsys.readouterr().out.split(":")[0]
    certificate(Action.LIST, data=data)
    line = f"{number}: force, valid, due on {shift(100)}, certificate 4711 of PTB Braunschweig, version 1"
    assert capsys.readouterr().out.strip() == line
    certificate(Action.WITHDRAW, number, "cell was dropped", data)
    capsys.readouterr()
    certificate(Action.LIST, data=data)
    assert f"{number}: force, withdrawn" in capsys.readouterr().out
    with open_catalogue(data) as catalogue:
        stored = catalogue.certificates.find(number)
    assert (stored.row.created_by, stored.withdrawal.reason) == ("command:M. Curie", "cell was dropped")


def test_a_certificate_is_added_once_and_withdrawn_once(path, tmp_path, capsys):
    certificate(Action.ADD, str(path), data=tmp_path)
    number = capsys.readouterr().out.split(":")[0]
    with pytest.raises(CertificateError, match="stored already"):
        certificate(Action.ADD, str(path), data=tmp_path)
    certificate(Action.WITHDRAW, number, "x", tmp_path)
    with pytest.raises(CertificateError, match="withdrawn already"):
        certificate(Action.WITHDRAW, number, "x", tmp_path)
    with pytest.raises(CertificateError, match="there is no certificate none"):
        certificate(Action.WITHDRAW, "none", "x", tmp_path)


def test_a_list_needs_a_catalogue_and_creates_none(tmp_path):
    with pytest.raises(CatalogueError, match="there is no catalogue"):
        certificate(Action.LIST, data=tmp_path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "words", [(Action.ADD,), (Action.LIST, "force.json"), (Action.WITHDRAW, "a"), (Action.ADD, "a", "reason")]
)
def test_misuse_is_refused(words, tmp_path):
    with pytest.raises(BadParameter):
        certificate(*words, data=tmp_path)
