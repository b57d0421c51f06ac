"""Preview of a method by the REST interface."""

import pytest

from bench.methods import compile_method, load_method


def test_a_preview_keeps_every_peak_of_motion_and_drive(service):
    programme = compile_method(load_method("identification"))
    preview = service.get("/methods/identification/preview")
    displacement, drive = preview["displacement_m"], preview["drive"]

    assert len(displacement["values"]) < 1300
    assert displacement["time_s"] == sorted(displacement["time_s"])
    assert (displacement["time_s"][0], displacement["time_s"][-1]) == (0, pytest.approx(programme.duration))
    for planned, shown in ((programme.displacement, displacement), (programme.drive, drive)):
        rows = [round(time * programme.rate) for time in shown["time_s"]]
        assert shown["values"] == [planned[row] for row in rows]
        assert (min(shown["values"]), max(shown["values"])) == (planned.min(), planned.max())


def test_a_preview_names_unit_segments_and_checkpoints(service):
    preview = service.get("/methods/six_voltages/preview")

    assert preview["drive_unit"] == "V"
    programme = compile_method(load_method("six_voltages"))
    assert [one["name"] for one in preview["segments"]] == [one.name for one in programme.segments]
    assert [one["checkpoint"] for one in preview["segments"]] == [one.checkpoint for one in programme.segments]
    starts = [one["start_s"] for one in preview["segments"]]
    assert starts == [pytest.approx(one.start / programme.rate) for one in programme.segments]


def test_the_preview_of_an_unknown_method_is_not_found(service):
    assert service.client.get("/api/v1/methods/none/preview").status_code == 404
