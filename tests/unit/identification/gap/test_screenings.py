"""A screening is made once for a set, as long as the set leaves what it left."""

from types import SimpleNamespace

import pytest

from identification.damper.effects import EFFECTS
from identification.gap import screenings
from identification.gap.screenings import Screenings

PROBLEM = SimpleNamespace(pieces=(SimpleNamespace(stroke=SimpleNamespace(rate=250.0)),))
SET = SimpleNamespace(names=frozenset({"gas_spring"}), fit=None)


@pytest.fixture
def made(monkeypatch):
    """Effects of the screenings that were really made."""
    asked = []

    def screen(problem, fit, choices, thin, line):
        asked.append(frozenset(choice.name for choice in choices))
        return [SimpleNamespace(choice=choice) for choice in choices]

    monkeypatch.setattr(screenings, "screen", screen)
    return asked


def ask(kept, without=("gas_spring",), left=0.5, beside=SET):
    gains = kept.beside(beside, frozenset(without), left, PROBLEM, lambda parent: 50.0)
    return {gain.choice.name for gain in gains}


def test_what_was_asked_is_not_asked_again(made):
    kept = Screenings()
    assert ask(kept) == ask(kept, left=0.51) == set(EFFECTS) - {"gas_spring"}
    assert len(made) == 1


def test_fewer_effects_are_taken_from_a_screening_of_more(made):
    kept = Screenings()
    ask(kept)
    assert ask(kept, ("gas_spring", "moving_mass")) == set(EFFECTS) - {"gas_spring", "moving_mass"}
    assert len(made) == 1


@pytest.mark.parametrize(
    "change",
    [{"left": 0.4}, {"beside": SimpleNamespace(names=frozenset({"end_stop"}), fit=None)}, {"without": ()}],
)
def test_another_question_is_asked(made, change):
    kept = Screenings()
    ask(kept)
    ask(kept, **change)
    assert len(made) == 2
