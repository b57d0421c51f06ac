"""Fits of many logs, each of its own specimen: one document each, and networks that are trained together."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from identification import pinn
from identification.commands import identify as identify_command
from identification.documents.fit import read_fit
from identification.errors import IdentificationError
from identification.fitting.budget import Budget
from identification.fitting.output_error import OptimiserSettings
from identification.logs.recording import Recording
from identification.pinn import training
from identification.pipeline import FitRequest, batch, identify
from tests.support.short_fit import LABORATORY, NOISE, fitted, recording

SMALL = {"network": "dense", "width": 6, "samples": 500, "steps": 10, "max_dampers": 16}


def weaker() -> Recording:
    """Another damper on the same strokes: three fifths of the force."""
    log = recording()
    (stretch,) = log.stretches
    return replace(log, stretches=(replace(stretch, force=0.6 * stretch.force),), sha256="1" * 64)


def dead() -> Recording:
    """A recording whose load cell is dead."""
    log = recording()
    (stretch,) = log.stretches
    return replace(log, stretches=(replace(stretch, force=0.0 * stretch.force),))


@pytest.fixture
def logs(monkeypatch):
    """Three logs, of which the second cannot be fitted."""
    recordings = {"a.mcap": recording(), "dead.mcap": dead(), "b.mcap": weaker()}
    monkeypatch.setattr(batch, "load", lambda log: replace(recordings[log.name], path=log))
    return [Path(name) for name in recordings]


@pytest.fixture
def small(tmp_path):
    path = tmp_path / "small.json"
    path.write_text(json.dumps(SMALL))
    return str(path)


def fits(entries):
    return [entry.fit for entry in entries if entry.fit is not None]


def test_every_log_gets_the_fit_that_it_would_get_alone_and_its_own_error(logs):
    second, first, third = batch.identify_batch(logs, FitRequest())
    assert first.fit.coordinates == fitted("refine").coordinates
    assert third.fit.coordinates == identify([weaker()], FitRequest()).coordinates
    assert third.fit.coordinates["F_a"].value == pytest.approx(0.6 * LABORATORY.F_a, rel=0.15)
    assert third.fit.rmse_n.train == pytest.approx(0.6 * NOISE, rel=0.03)
    assert second.fit is None
    assert "force" in second.failure


def test_the_dense_network_is_trained_on_all_of_them_at_once(logs, small, monkeypatch):
    sizes, once = [], training.train_batch

    def counted(problems, *rest):
        sizes.append(len(problems))
        return once(problems, *rest)

    monkeypatch.setattr(pinn, "train_batch", counted)
    first, third = fits(batch.identify_batch(logs, FitRequest(stages=("pinn", "refine"), preset=small)))
    assert sizes == [2]
    assert [stage.name for stage in first.stages] == ["pinn", "refine"]
    assert first.stages[0].note.startswith("all layers trained")
    assert first.stages[0].coordinates["F_a"].value != third.stages[0].coordinates["F_a"].value
    assert list(third.provenance.logs) == ["b.mcap"]


def test_the_budget_of_a_batch_is_that_of_each_log(logs, small):
    request = FitRequest(
        settings=OptimiserSettings(budget=Budget(seconds=1e-3)), stages=("pinn", "refine"), preset=small
    )
    assert fits(batch.identify_batch(logs, request))[0].agreement.startswith(
        "not compared: pinn found nothing, its budget of 0.001 s"
    )
    (alone,) = fits(batch.identify_batch(logs[:1], request))
    assert alone.agreement.endswith("0.0005 s of processor time ended")


def run_command(logs, out, **more):
    given = {"stages": "refine", "preset": "elements", "hold_out": "", "hold_out_after": None, "delay_prior": None}
    rest = {"budget": "", "seed": 1, "free": "", "profile": False, "each": True}
    return identify_command.identify(logs, out, **(given | rest | more))


def test_the_command_writes_what_can_be_fitted_and_names_what_cannot(logs, tmp_path):
    with pytest.raises(IdentificationError, match=r"1 of 3 logs could not be fitted: dead\.mcap: "):
        run_command(logs, tmp_path / "fits")
    assert sorted(p.name for p in (tmp_path / "fits").iterdir()) == ["a.json", "b.json"]
    assert read_fit(tmp_path / "fits" / "b.json").rmse_n.train == pytest.approx(0.6 * NOISE, rel=0.03)


def test_a_batch_that_is_ended_early_keeps_the_fits_so_far(logs, tmp_path, monkeypatch):
    once = batch.fit_damper

    def ended_at_b(ready, *rest):
        if ready.problem.pieces[0].force.std() < 0.8 * recording().stretches[0].force.std():
            raise KeyboardInterrupt
        return once(ready, *rest)

    monkeypatch.setattr(batch, "fit_damper", ended_at_b)
    with pytest.raises(KeyboardInterrupt):
        run_command(logs, tmp_path / "fits")
    assert [p.name for p in (tmp_path / "fits").iterdir()] == ["a.json"]


@pytest.mark.parametrize(
    ("names", "out", "more", "reason"),
    [
        (
            ["x/a.mcap", "y/a.mcap"],
            "fits",
            {},
            r"x/a\.mcap and y/a\.mcap would both be written to .*a\.json; rename",
        ),
        (["a.mcap"], "-", {}, "several documents; name a folder"),
        (["a.mcap"], "no/fits", {}, "there is no folder"),
        (["a.mcap"], "fits", {"free": "offset"}, "--free is for several logs of one specimen"),
    ],
)
def test_what_cannot_be_written_or_asked_is_refused_before_the_work(tmp_path, names, out, more, reason):
    path = Path(out) if out == "-" else tmp_path / out
    with pytest.raises(IdentificationError, match=reason):
        run_command([Path(name) for name in names], path, **more)
    assert not (tmp_path / "fits").exists()
