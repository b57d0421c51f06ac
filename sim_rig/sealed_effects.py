"""Sealed effects as a scenario names them: which form, which values."""

from collections.abc import Sequence

from sim_rig.scenarios.sealed import FORMS, Form, Place
from sim_rig.settings import EffectInPlay


def form_of(effect: EffectInPlay) -> Form:
    """The sealed form of an effect."""
    return FORMS[str(effect.form)]


def size(effect: EffectInPlay) -> float:
    """The first parameter of an effect, in its unit; at zero nothing happens."""
    return effect.parameters[form_of(effect).parameters[0].symbol]


def check_sealed(effects: Sequence[EffectInPlay]) -> None:
    """Whether the effects of a scenario can be played.

    Raises:
        ValueError: a form or its parameters do not exist, or two forms want the same single place.
    """
    for effect in effects:
        _check(effect)
    names = [effect.name for effect in effects]
    if len(set(names)) < len(names):
        raise ValueError(f"a sealed effect stands twice among {', '.join(sorted(names))}")
    if sum(form_of(effect).place is Place.CONNECTION for effect in effects) > 1:
        raise ValueError("two sealed effects make one connection; leave one of them out")


def _check(effect: EffectInPlay) -> None:
    form = FORMS.get(str(effect.form))
    if form is None or form.effect != effect.name:
        there = ", ".join(sorted(f"{f.effect}: {f.form}" for f in FORMS.values()))
        raise ValueError(f"no sealed form {effect.form!r} of {effect.name!r}; there are {there}")
    wanted = [quantity.symbol for quantity in form.parameters]
    if list(effect.parameters) != wanted:
        raise ValueError(
            f"{form.form} takes {', '.join(wanted)} in this order, not {', '.join(effect.parameters)}"
        )
    for q in form.parameters:
        value = effect.parameters[q.symbol]
        if not q.low <= value <= q.high:
            unit = "" if q.unit == "1" else f" {q.unit}"
            raise ValueError(f"{form.form}.{q.symbol} is {value:g}{unit}, outside {q.low:g} to {q.high:g}{unit}")
