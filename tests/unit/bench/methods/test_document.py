"""Method document: valid documents, and the messages on invalid ones."""

import json
from pathlib import Path

import pytest
from pydantic import ValidationError

from bench.errors import MethodError
from bench.methods import Method, list_shipped_methods, load_method

SINE = {"kind": "sine", "amplitude_m": 0.01, "frequency_hz": 1}
SEGMENT = {"name": "a", "motion": SINE, "cycles": 2, "drive": {"kind": "constant", "value": 0.1}}
TABLE = {"kind": "table", "time_s": [0, 1], "displacement_m": [0, 0.01]}
METHOD = {
    "schema": "mrbench.method/1",
    "name": "trial",
    "title": "t",
    "description": "d",
    "rate_hz": 1000,
    "drive_kind": "coil_v",
    "limits": {"stroke_m": 0.02, "velocity_mps": 0.3, "acceleration_mps2": 6, "force_n": 900, "drive": 0.5},
    "segments": [SEGMENT],
}


def saved(folder: Path, **changes: object) -> Path:
    path = folder / "method.json"
    path.write_text(json.dumps({**METHOD, **changes}))
    return path


def with_segment(folder: Path, **changes: object) -> Path:
    return saved(folder, segments=[{**SEGMENT, **changes}])


def test_a_shipped_method_is_loaded_by_its_name_and_any_other_by_its_file(tmp_path):
    assert load_method("quick").name == "quick"
    assert load_method(saved(tmp_path)).name == "trial"


@pytest.mark.parametrize("name", list_shipped_methods())
def test_a_method_is_unchanged_after_writing_and_reading(name, tmp_path):
    method = load_method(name)
    path = tmp_path / "again.json"
    path.write_text(method.to_json())
    assert load_method(path) == method


def test_a_method_cannot_be_changed():
    with pytest.raises(ValidationError, match="frozen"):
        load_method("quick").name = "other"


def test_the_drive_unit_follows_from_the_drive_kind(tmp_path):
    assert load_method(saved(tmp_path)).drive_unit == "V"
    assert load_method(saved(tmp_path, drive_kind="coil_a")).drive_unit == "A"


def test_message_on_an_unknown_name_lists_the_shipped_methods():
    with pytest.raises(
        MethodError, match=r"no method nonsense: neither a file nor one of identification, .*quick"
    ):
        load_method("nonsense")


def test_text_that_is_not_json_is_refused(tmp_path):
    path = tmp_path / "broken.json"
    path.write_text("{")
    with pytest.raises(MethodError, match="is not a method: not JSON"):
        load_method(path)


def test_a_folder_or_a_binary_file_is_refused(tmp_path):
    (tmp_path / "binary.json").write_bytes(b"\xff\xfe\x00")
    for path in (tmp_path, tmp_path / "binary.json"):
        with pytest.raises(MethodError, match="cannot be read"):
            load_method(path)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"speed": 3}, r"segments.0 ?.*\(a\).*no such key"),
        ({"motion": {**SINE, "amplitude_m": float("nan")}}, r"segments.0.motion.sine.amplitude_m \(a\)"),
        ({"motion": {"kind": "waltz"}}, r"\(a\): kind 'waltz' is none of 'hold', 'ramp', 'sine'"),
        ({"duration_s": 2}, "either cycles or duration_s"),
        ({"cycles": None}, "either cycles or duration_s"),
        ({"name": "a b"}, "name"),
        ({"drive": {"kind": "steps", "values": [1]}}, "steps need either time_s or phase_cycles"),
        ({"drive": {"kind": "steps", "values": [1], "time_s": [0, 1]}}, "2 times for 1 values"),
        ({"drive": {"kind": "table", "values": [1, 2], "time_s": [0.5, 1]}}, "begin at 0 s and increase"),
        ({"motion": {**TABLE, "time_s": [0, 0]}}, "begin at 0 s and increase"),
        (
            {"motion": {**SINE, "kind": "triangle", "corner_acceleration_mps2": 0.1}},
            "need at least 0.32 m/s²",
        ),
        (
            {"motion": {"kind": "random", "spectrum": {"low_hz": 3, "high_hz": 2, "rms_m": 0.001}, "seed": 1}},
            "high_hz 2 Hz must exceed low_hz 3 Hz",
        ),
    ],
)
def test_a_faulty_segment_is_refused_with_its_position_and_name(changes, message, tmp_path):
    with pytest.raises(MethodError, match=message) as caught:
        load_method(with_segment(tmp_path, **changes))
    assert "\n" not in str(caught.value)


def test_several_faults_are_counted(tmp_path):
    with pytest.raises(MethodError, match=r"title: .* \(and 1 more\)"):
        load_method(saved(tmp_path, title="", rate_hz=-1))


def test_a_document_that_is_not_an_object_is_refused(tmp_path):
    path = tmp_path / "list.json"
    path.write_text("[]")
    with pytest.raises(MethodError, match="the document: "):
        load_method(path)


def test_two_segments_of_one_name_are_refused(tmp_path):
    with pytest.raises(MethodError, match="segment name a is used twice"):
        load_method(saved(tmp_path, segments=[SEGMENT, SEGMENT]))


@pytest.mark.parametrize("name", list_shipped_methods())
def test_every_shipped_method_is_valid_by_the_schema(name):
    import jsonschema

    schema = Method.model_json_schema(by_alias=True)
    jsonschema.validate(json.loads(load_method(name).to_json()), schema)


def test_the_method_in_the_readme_is_a_method(tmp_path):
    import bench.methods

    text = (Path(bench.methods.__file__).parent / "README.md").read_text()
    path = tmp_path / "example.json"
    path.write_text(text.split("```json\n")[1].split("```")[0])
    assert load_method(path).name == "my_method"


@pytest.mark.parametrize(
    ("name", "sha256"),
    [
        ("quick", "eab7d363022786736e56db52d7e05e09268711e4308c3532016bf7a7fb12b4c6"),
        ("zero_check", "e3d5580ace0579b9070551a0e3bc7db6a7e8bc5903760ec6a571b078d2655882"),
    ],
)
def test_a_later_optional_field_does_not_change_the_hash_of_a_method(name, sha256):
    """Logs and approvals refer to these hashes."""
    assert load_method(name).compute_sha256() == sha256
