"""Many logs, each of a specimen of its own: a document each, and networks that are trained together."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from test_stages import LABORATORY, NOISE, fitted, recording

from identification import campaign, commands
from identification.errors import IdentificationError
from identification.identify import Request, identify
from identification.pinn import train
from identification.recordings import Recording
from identification.refine import Settings
from identification.results import read_fit

SMALL = {"network": "global", "width": 6, "samples": 500, "steps": 10}


def weaker() -> Recording:
    """Another damper on the same strokes: three fifths of the force."""
    made = recording()
    (stretch,) = made.stretches
    return replace(made, stretches=(replace(stretch, force=0.6 * stretch.force),), sha256="1" * 64)


def dead() -> Recording:
    """A load cell that says nothing."""
    made = recording()
    (stretch,) = made.stretches
    return replace(made, stretches=(replace(stretch, force=0.0 * stretch.force),))


@pytest.fixture
def logs(monkeypatch):
    """Three logs, of which the second cannot be fitted."""
    recordings = {"a.mcap": recording(), "dead.mcap": dead(), "b.mcap": weaker()}
    monkeypatch.setattr(campaign, "load", lambda log: replace(recordings[log.name], path=log))
    return [Path(name) for name in recordings]


@pytest.fixture
def small(tmp_path):
    place = tmp_path / "small.json"
    place.write_text(json.dumps(SMALL))
    return str(place)


def fits(found):
    return [one.fit for one in found if one.fit is not None]


def test_every_log_gets_the_fit_that_it_would_get_alone_and_its_own_error(logs):
    second, first, third = campaign.identify_each(logs, Request())
    assert first.fit.coordinates == fitted("refine").coordinates
    assert third.fit.coordinates == identify([weaker()], Request()).coordinates
    assert third.fit.coordinates["F_a"].value == pytest.approx(0.6 * LABORATORY.F_a, rel=0.15)
    assert third.fit.rmse_n.train == pytest.approx(0.6 * NOISE, rel=0.03)
    assert second.fit is None
    assert "force" in second.why_not


def test_the_global_network_is_trained_on_all_of_them_at_once(logs, small, monkeypatch):
    sizes, once = [], train.train_batch

    def counted(problems, *rest):
        sizes.append(len(problems))
        return once(problems, *rest)

    monkeypatch.setattr(train, "train_batch", counted)
    monkeypatch.setattr(train, "_ON_A_PROCESSOR", 16)
    first, third = fits(campaign.identify_each(logs, Request(stages=("pinn", "refine"), preset=small)))
    assert sizes == [2]
    assert [stage.name for stage in first.stages] == ["pinn", "refine"]
    assert first.stages[0].note.startswith("all layers trained")
    assert first.stages[0].coordinates["F_a"].value != third.stages[0].coordinates["F_a"].value
    assert list(third.provenance.logs) == ["b.mcap"]


def test_the_budget_of_a_batch_is_that_of_each_log(logs, small, monkeypatch):
    monkeypatch.setattr(train, "_ON_A_PROCESSOR", 16)
    request = Request(settings=Settings(budget=1e-3), stages=("pinn", "refine"), preset=small)
    assert fits(campaign.identify_each(logs, request))[0].agreement.startswith(
        "not compared: pinn found nothing, its budget of 0.001 s"
    )
    (alone,) = fits(campaign.identify_each(logs[:1], request))
    assert alone.agreement.endswith("0.0005 s of processor time ended")


def asked(logs, out, **more):
    given = {"stages": "refine", "preset": "local", "hold_out": "", "hold_out_after": None, "delay_prior": None}
    rest = {"budget": None, "seed": 1, "free": "", "profile": False, "each": True}
    return commands.identify(logs, out, **(given | rest | more))


def test_the_command_writes_what_can_be_fitted_and_names_what_cannot(logs, tmp_path):
    with pytest.raises(IdentificationError, match=r"1 of 3 logs have no fit: dead\.mcap: "):
        asked(logs, tmp_path / "fits")
    assert sorted(p.name for p in (tmp_path / "fits").iterdir()) == ["a.json", "b.json"]
    assert read_fit(tmp_path / "fits" / "b.json").rmse_n.train == pytest.approx(0.6 * NOISE, rel=0.03)


def test_what_is_done_is_kept_where_a_campaign_is_ended_early(logs, tmp_path, monkeypatch):
    once = campaign.conclude

    def ended_at_b(ready, *rest):
        if ready.problem.pieces[0].force.std() < 0.8 * recording().stretches[0].force.std():
            raise KeyboardInterrupt
        return once(ready, *rest)

    monkeypatch.setattr(campaign, "conclude", ended_at_b)
    with pytest.raises(KeyboardInterrupt):
        asked(logs, tmp_path / "fits")
    assert [p.name for p in (tmp_path / "fits").iterdir()] == ["a.json"]


@pytest.mark.parametrize(
    ("names", "out", "more", "why"),
    [
        (["x/a.mcap", "y/a.mcap"], "fits", {}, r"x/a\.mcap and y/a\.mcap would both go to .*a\.json; rename"),
        (["a.mcap"], "-", {}, "several documents; name a folder"),
        (["a.mcap"], "no/fits", {}, "there is no folder"),
        (["a.mcap"], "fits", {"free": "offset"}, "with --each none are of one"),
    ],
)
def test_what_cannot_be_written_or_asked_is_refused_before_the_work(tmp_path, names, out, more, why):
    place = Path(out) if out == "-" else tmp_path / out
    with pytest.raises(IdentificationError, match=why):
        asked([Path(name) for name in names], place, **more)
    assert not (tmp_path / "fits").exists()
