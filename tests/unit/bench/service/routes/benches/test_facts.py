"""Facts of the bench: limits, channels, instruments, lease."""


def test_limits_and_channels_have_units(service):
    assert service.get("/bench/limits")["force"]["unit"] == "N"
    assert service.get("/bench/channels")["force"] == {"unit": "N", "rate_hz": 1000.0, "delay_s": 0.0}
    assert service.get("/bench/instruments") == []


def test_the_lease_names_the_run_that_holds_the_bench(service):
    assert service.get("/bench/lease")["holder"] is None
    run = service.post("/runs", {"method": "quick", "specimen": "MR-1", "operator": "M. Curie"}, 201)
    lease = service.get("/bench/lease")
    assert (lease["holder"], lease["id"], lease["operator"]) == ("run", run["id"], "M. Curie")
    assert lease["until"] > lease["since"]
    assert "23 s more" in lease["description"]
