"""Active effects of a scenario: their definitions, and the check of their forms and parameters.

A definition of the user's own effect files is copied into the scenario, which then plays on any machine.
"""

from collections.abc import Iterable, Mapping, Sequence

from identification.damper import Quantity, widen_bounds
from identification.damper.definitions import read_effect_files
from identification.damper.effects import EFFECTS, rename_form, rename_parameters
from sim_rig.scenario.sections import ActiveEffect


def check_effects(effects: Sequence[ActiveEffect]) -> tuple[ActiveEffect, ...]:
    """Return the effects with their definitions and the present names of their forms and parameters.

    Raises:
        ValueError: an effect, its form or a parameter does not exist, a value is out of bounds, an effect is
            listed twice, or two have a friction with deflection.
    """
    complete = tuple(_use_present_names(_find_definition(effect)) for effect in effects)
    for effect in complete:
        _check_effect(effect)
    names = [effect.name for effect in complete]
    if len(set(names)) < len(names):
        raise ValueError(f"an effect is listed twice among {_join_names(names)}; merge its entries")
    # The rig integrates one deflection, which both would share.
    deflecting = [e.name for e in complete if e.effect.find_form(e.form).action == "hysteretic_force"]
    if len(deflecting) > 1:
        raise ValueError(
            f"{_join_names(deflecting)} have a friction with deflection each, at most one may; give the other "
            "one a form without"
        )
    return complete


def check_bounds(quantities: Iterable[Quantity], values: Mapping[str, float], prefix: str = "") -> None:
    """Check values against the bounds of their quantities; ``prefix`` precedes a symbol in messages.

    Raises:
        ValueError: a value is out of bounds.
    """
    for q in quantities:
        # Coordinates are computed, so rounding may put one that is at its bound slightly beyond it.
        value, rounding = values[q.symbol], 1e-9 * (abs(values[q.symbol]) + q.scale)
        if not q.low - rounding <= value <= q.high + rounding:
            unit = "" if q.unit == "1" else f" {q.format_unit('drive')}"
            raise ValueError(
                f"{prefix}{q.symbol} ({q.meaning}) is {value:g}{unit}, outside {q.low:g} to {q.high:g}{unit}"
            )


def _find_definition(effect: ActiveEffect) -> ActiveEffect:
    """Return the effect with the definition of the user's effect file, if it has none and needs one."""
    if effect.definition is not None:
        if effect.definition.name != effect.name:
            raise ValueError(f"{effect.name} has a definition of {effect.definition.name}; use one name for both")
        return effect
    if effect.name in EFFECTS:
        return effect
    files = read_effect_files()
    if effect.name not in files:
        raise ValueError(f"no effect {effect.name!r}; there are {_join_names([*EFFECTS, *files])}")
    return effect.model_copy(update={"definition": files[effect.name]})


def _use_present_names(effect: ActiveEffect) -> ActiveEffect:
    """Return the effect with the present names of its form and parameters, as the library has them."""
    form = None if effect.form is None else rename_form(effect.name, effect.form)
    parameters = rename_parameters(effect.name, effect.parameters)
    return effect.model_copy(update={"form": form, "parameters": parameters})


def _check_effect(effect: ActiveEffect) -> None:
    forms = [form.name for form in effect.effect.forms]
    if effect.form is not None and effect.form not in forms:
        raise ValueError(f"{effect.name} has the form {_join_names(forms)}, not {effect.form}")
    quantities = effect.effect.find_form(effect.form).parameters
    if effect.definition is None:
        # A definition is that of one damper, so its bounds hold as they are.
        quantities = tuple(widen_bounds(q) for q in quantities)
    symbols = {quantity.symbol for quantity in quantities}
    if effect.parameters.keys() != symbols:
        raise ValueError(f"{effect.name} takes {_join_names(symbols)}, not {_join_names(effect.parameters)}")
    check_bounds(quantities, effect.parameters, f"{effect.name}.")


def _join_names(names: Iterable[str]) -> str:
    return ", ".join(sorted(names)) or "none"
