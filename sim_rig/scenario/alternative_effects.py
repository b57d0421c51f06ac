"""Alternative effects of a scenario: their forms, their sizes, and the check of their parameters."""

from collections.abc import Sequence

from sim_rig.effect_forms import FORMS, AlternativeForm, Place
from sim_rig.scenario.sections import ActiveEffect


def find_form(effect: ActiveEffect) -> AlternativeForm:
    """Return the alternative form of an effect."""
    return FORMS[str(effect.form)]


def get_size(effect: ActiveEffect) -> float:
    """Return the first parameter of an effect, in its unit; at zero the effect does nothing."""
    return effect.parameters[find_form(effect).parameters[0].symbol]


def rename_former_symbols(effect: ActiveEffect) -> ActiveEffect:
    """Return the effect with former parameter symbols replaced by the present ones; the order is kept."""
    form = FORMS.get(str(effect.form))
    if form is None or not form.former_symbols.keys() & effect.parameters.keys():
        return effect
    parameters = {form.former_symbols.get(symbol, symbol): value for symbol, value in effect.parameters.items()}
    return effect.model_copy(update={"parameters": parameters})


def check_alternative_effects(effects: Sequence[ActiveEffect]) -> None:
    """Check that the alternative effects of a scenario can be played together.

    Raises:
        ValueError: a form or its parameters do not exist, or two forms need the same single place.
    """
    for effect in effects:
        _check_effect(effect)
    names = [effect.name for effect in effects]
    if len(set(names)) < len(names):
        raise ValueError(f"an alternative effect is listed twice among {', '.join(sorted(names))}")
    if sum(find_form(effect).place is Place.MOUNTING for effect in effects) > 1:
        raise ValueError("two alternative effects act in the mounting; leave one of them out")


def _check_effect(effect: ActiveEffect) -> None:
    if effect.definition is not None:
        raise ValueError(f"{effect.name} has a definition; list it among `effects`")
    form = FORMS.get(str(effect.form))
    if form is None or form.effect != effect.name:
        known = ", ".join(sorted(f"{f.effect}: {f.form}" for f in FORMS.values()))
        raise ValueError(f"no alternative form {effect.form!r} of {effect.name!r}; there are {known}")
    symbols = [quantity.symbol for quantity in form.parameters]
    if list(effect.parameters) != symbols:
        raise ValueError(
            f"{form.form} takes {', '.join(symbols)} in this order, not {', '.join(effect.parameters)}"
        )
    for q in form.parameters:
        value = effect.parameters[q.symbol]
        if not q.low <= value <= q.high:
            unit = "" if q.unit == "1" else f" {q.unit}"
            raise ValueError(f"{form.form}.{q.symbol} is {value:g}{unit}, outside {q.low:g} to {q.high:g}{unit}")
