"""Stored methods, their versions, and the methods that runs record."""

from bench.methods import load_method


def make_document(**changes):
    document = load_method("quick").model_dump(mode="json", by_alias=True, exclude_defaults=True)
    return {**document, **changes}


def test_every_version_keeps_its_content_and_equal_content_makes_none(service):
    document = make_document(name="mine")
    first = service.post("/methods", document, 201)
    assert (first["version"], first["source"], first["usable"]) == (1, "stored", True)
    assert service.post("/methods", document, 200)["version"] == 1
    second = service.post("/methods", {**document, "title": "Another title"}, 201)
    assert second["version"] == 2
    assert service.get("/methods/mine")["title"] == "Another title"
    assert service.get("/methods/mine/1")["title"] == document["title"]
    listed = {one["name"]: one["version"] for one in service.get("/methods")["items"]}
    assert listed["mine"] == 2
    assert service.client.get("/api/v1/methods/mine/3").status_code == 404


def test_an_included_method_stays_version_1_of_its_name(service):
    assert service.post("/methods", make_document(), 200)["source"] == "included"
    assert service.post("/methods", make_document(title="Changed"), 201)["version"] == 2
    assert service.get("/methods/quick/1")["title"] == load_method("quick").title


def test_an_invalid_method_is_refused_at_its_field(service):
    document = make_document(name="mine")
    document["segments"][0]["motion"]["amplitude_m"] = -1
    answer = service.post("/methods", document, 422)
    assert answer["detail"].startswith("body.segments.0.motion.sine.amplitude_m")
    document["segments"][0]["motion"]["amplitude_m"] = 1.0
    assert "exceeds the limit" in service.post("/methods", document, 422)["detail"]


def test_a_run_records_version_and_hash_so_that_methods_of_one_name_differ(service):
    inline = make_document(title="Changed")
    runs = []
    for method in ("quick", inline):
        runs.append(service.post("/runs", {"method": method, "specimen": "MR-1"}, 201))
        service.agent.finish()
    hashes = [one["method_sha256"] for one in runs]
    assert hashes[0] == load_method("quick").compute_sha256()
    assert hashes[0] != hashes[1]
    assert [one["method_version"] for one in runs] == [1, None]


def test_methods_for_another_drive_say_why_they_cannot_run(service):
    service.agent.status = service.agent.status.model_copy(update={"drive_kind": "coil_v"})
    service.get("/bench")
    listed = {one["name"]: one for one in service.get("/methods")["items"]}
    assert listed["quick"]["usable"]
    assert listed["six_currents"]["obstacle"] == "the method sets the coil current, this bench the coil voltage"


def test_every_included_method_has_a_checkpoint(service):
    assert all(one["checkpoints"] for one in service.get("/methods")["items"])


def test_a_version_that_no_column_can_hold_is_not_found(service):
    assert service.client.get(f"/api/v1/methods/quick/{2**70}").status_code == 404


def test_a_version_can_be_started(service):
    service.post("/methods", make_document(name="mine"), 201)
    service.post("/methods", make_document(name="mine", title="Changed"), 201)
    body = {"method": "mine", "method_version": 1, "specimen": "MR-1"}
    assert service.post("/runs", body, 201)["method_version"] == 1
