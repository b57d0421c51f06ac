"""Folder of effect files: what is read from it, and what is written into it."""

import json

import pytest

from identification.damper.definitions import (
    find_effect_folder,
    load_effects,
    make_effect,
    parse_effect_file,
    read_effect_files,
    write_effect_file,
)
from identification.damper.definitions import library as definitions_library
from identification.damper.effects import EFFECTS
from identification.errors import EffectFileError


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Return a folder that does not exist yet, as that of the user."""
    monkeypatch.setenv("MRBENCH_EFFECTS", str(tmp_path / "some" / "effects"))
    return tmp_path / "some" / "effects"


@pytest.fixture
def file(content):
    return parse_effect_file(json.dumps(content), "mine.json")


def save(folder, name, content):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_text(json.dumps(content), encoding="utf-8")


def test_the_folder_is_named_by_the_environment(folder):
    assert find_effect_folder() == folder


@pytest.mark.parametrize("named", ["", None])
def test_otherwise_it_is_in_the_configuration_of_the_user(named, tmp_path, monkeypatch):
    monkeypatch.setattr(definitions_library, "user_config_path", lambda name: tmp_path / name)
    if named is None:
        monkeypatch.delenv("MRBENCH_EFFECTS", raising=False)
    else:
        monkeypatch.setenv("MRBENCH_EFFECTS", named)
    assert find_effect_folder() == tmp_path / "mrbench" / "effects"


def test_without_a_folder_there_is_the_library_alone(folder):
    assert not folder.exists()
    assert read_effect_files() == {}
    assert load_effects() == EFFECTS
    assert not folder.exists()


def test_files_add_to_the_library(folder, content, file):
    save(folder, "b.json", content)
    save(folder, "a.json", content | {"name": "other_friction"})
    (folder / "notes.txt").write_text("not an effect", encoding="utf-8")
    assert list(read_effect_files()) == ["other_friction", "rising_friction"]
    effects = load_effects()
    assert list(effects) == [*EFFECTS, "other_friction", "rising_friction"]
    assert effects["rising_friction"] == make_effect(file)
    assert "rising_friction" not in EFFECTS


def test_a_folder_can_be_given(folder, tmp_path, content):
    save(tmp_path / "elsewhere", "a.json", content)
    assert list(read_effect_files(tmp_path / "elsewhere")) == ["rising_friction"]
    assert "rising_friction" in load_effects(tmp_path / "elsewhere")
    assert load_effects() == EFFECTS


def test_two_files_of_one_name_are_refused(folder, content):
    save(folder, "a.json", content)
    save(folder, "b.json", content)
    with pytest.raises(EffectFileError) as refusal:
        load_effects()
    message = "another file of this folder defines rising_friction too; rename one"
    assert str(refusal.value) == f"{folder / 'b.json'}: {message}"


def test_a_file_that_cannot_be_read_is_named(folder):
    (folder / "a.json").mkdir(parents=True)
    with pytest.raises(EffectFileError) as refusal:
        read_effect_files()
    assert str(refusal.value) == f"{folder / 'a.json'}: cannot be read (Is a directory)"


def test_a_file_that_is_not_valid_is_named(folder, content):
    save(folder, "a.json", content)
    save(folder, "b.json", content | {"name": "gas_spring"})
    with pytest.raises(EffectFileError) as refusal:
        load_effects()
    assert str(refusal.value) == f"{folder / 'b.json'}: the library has an effect gas_spring; choose another name"


def test_a_written_file_is_read_again_and_its_folder_is_made(folder, file):
    path = write_effect_file(file)
    assert path == folder / "rising_friction.json"
    assert [entry.name for entry in folder.iterdir()] == ["rising_friction.json"]
    assert read_effect_files() == {"rising_friction": file}


def test_a_written_file_can_be_read_by_a_person(tmp_path, content, curve_content):
    content["meaning"] = "Reibung über dem Feld, µm"
    path = write_effect_file(parse_effect_file(json.dumps(content), "mine.json"), tmp_path)
    text = path.read_bytes().decode("utf-8")
    assert json.loads(text) == content
    assert text.endswith("}\n")
    assert '\n  "meaning": "Reibung über dem Feld, µm",\n' in text
    curve = parse_effect_file(json.dumps(curve_content), "mine.json")
    write_effect_file(curve, tmp_path)
    assert read_effect_files(tmp_path)["measured_friction"] == curve


def test_an_existing_file_is_kept(folder, file):
    path = write_effect_file(file)
    before = path.read_bytes()
    with pytest.raises(EffectFileError) as refusal:
        write_effect_file(file.model_copy(update={"meaning": "another"}))
    message = "there is an effect rising_friction; choose another name or remove its file"
    assert str(refusal.value) == f"{path}: {message}"
    assert path.read_bytes() == before


def test_a_name_in_a_file_of_another_name_is_taken_too(folder, content, file):
    save(folder, "a.json", content)
    with pytest.raises(EffectFileError, match="there is an effect rising_friction"):
        write_effect_file(file)
    assert [entry.name for entry in folder.iterdir()] == ["a.json"]


def test_a_file_that_defines_another_effect_is_kept_too(folder, content, file):
    save(folder, "rising_friction.json", content | {"name": "other_friction"})
    with pytest.raises(EffectFileError, match="there is an effect rising_friction"):
        write_effect_file(file)
    assert list(read_effect_files()) == ["other_friction"]


def test_nothing_is_written_into_a_folder_with_a_file_that_is_not_valid(folder, content, file):
    save(folder, "a.json", content | {"name": "gas_spring"})
    with pytest.raises(EffectFileError, match=r"a\.json: the library has an effect gas_spring"):
        write_effect_file(file)
    assert [entry.name for entry in folder.iterdir()] == ["a.json"]


def test_a_folder_that_cannot_be_made_is_named(tmp_path, file):
    (tmp_path / "taken").write_text("a file", encoding="utf-8")
    with pytest.raises(EffectFileError, match=r"rising_friction\.json: cannot be written \(.+\)"):
        write_effect_file(file, tmp_path / "taken" / "effects")
