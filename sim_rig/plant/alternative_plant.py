"""Plant with alternative forms of effects: a specimen on its actuator with the interface of `Plant`."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from sim_rig.effect_forms import INPUT_COUNT, MAX_PARAMETERS, MAX_STATES, AlternativeForm, Place, X
from sim_rig.errors import PlantError
from sim_rig.plant import alternative_integrator as integrator
from sim_rig.plant import alternative_states as states
from sim_rig.plant.constants import compute_rig_rate, make_rig_constants
from sim_rig.plant.jit import Array, FixedAddress, compile_function
from sim_rig.plant.plant import Plant, TrueSignals, count_substeps
from sim_rig.plant.states import ACTUATOR_COMPLIANCE, AMBIENT, Z_SATURATION
from sim_rig.scenario import ActiveEffect, Scenario, find_form, get_size

_SETTLING_TIME = 0.2
"""[s] standstill before a run, in which the forms' filters settle."""


class AlternativePlant(Plant):
    """One specimen with alternative forms, advanced by ``advance`` or ``simulate``.

    It starts at rest at its first commanded position, with a relaxed loop and the field at its drive. The forms'
    states start at zero and settle during a short standstill.
    """

    def __init__(self, scenario: Scenario, displacement: float = 0.0, drive: float = 0.0) -> None:
        """Settle the specimen of a scenario at a displacement [m] and a drive [V or A].

        Raises:
            PlantError: it has no finite force there.
        """
        effects = [effect for effect in scenario.alternative_effects if get_size(effect) != 0.0]
        forms = [find_form(effect) for effect in effects]
        self._law = np.array(scenario.parameters)
        self._forms = _compile_forms(forms, effects)
        self._constants = _make_constants(scenario, self._law, forms, effects)
        self._command, self._samples = displacement, 0
        self._inputs, self._time = np.zeros(INPUT_COUNT), -_SETTLING_TIME
        self._work = np.zeros((6, states.STATE_COUNT))
        self._states = _make_rest_states(self._law, self._constants, displacement, drive)
        self._settle(displacement, drive)

    def _settle(self, displacement: float, drive: float) -> None:
        """Let the forms' filters settle at standstill."""
        dt = 1e-3
        count = round(_SETTLING_TIME / dt)
        self.simulate(dt, np.full(count + 1, displacement), np.full(count, drive))
        # The standstill is not part of the run.
        self._time, self._samples = 0.0, 0
        self._states[states.PATH] = 0.0

    def simulate(self, dt: float, command: Array, drive: Array) -> TrueSignals:
        """Advance through M samples of dt [s], as `Plant.simulate` does."""
        count, substeps = len(drive), count_substeps(dt)
        (force, position, velocity), output = np.empty((3, count * substeps)), np.empty(count)
        damper, record = np.empty((count, 2)), np.empty((count, states.STATE_COUNT))
        done = integrator.integrate(
            self._states, self._inputs, self._time, np.ascontiguousarray(command, float),
            np.ascontiguousarray(drive, float), dt / substeps, substeps, self._constants, self._law,
            *self._forms.functions, self._forms.places, self._forms.values, self._forms.exponents,
            force, position, velocity, output, damper, record,
            self._work,
        )  # fmt: skip
        if done < count:
            raise PlantError(
                f"the specimen runs away {(self._samples + done) * dt:.3f} s into its motion, at "
                f"{record[done, states.POSITION]:.4g} m: no finite force; check damper, forms and stroke"
            )
        self._command, self._samples = float(command[-1]), self._samples + count
        self._time += count * dt
        return TrueSignals(
            position=position,
            velocity=velocity,
            force=force,
            output=output,
            damper_displacement=damper[:, 0],
            damper_velocity=damper[:, 1],
            y=record[:, states.Y],
            z=record[:, states.Z],
            field=record[:, states.FIELD],
            temperature=record[:, states.TEMPERATURE],
        )


def make_plant(scenario: Scenario, displacement: float = 0.0, drive: float = 0.0) -> Plant:
    """Return the specimen of a scenario, at rest at a displacement [m] and a drive [V or A].

    Raises:
        PlantError: it has no finite force there.
    """
    return (AlternativePlant if scenario.alternative_effects else Plant)(scenario, displacement, drive)


def apply_displacement_channel(scenario: Scenario, position: Array) -> Array:
    """Apply the alternative forms of the displacement channel to the actuator's position (K,) [m]."""
    for effect in scenario.alternative_effects:
        form = find_form(effect)
        if form.place is Place.DISPLACEMENT_CHANNEL and get_size(effect) != 0.0:
            function = compile_function(form.function, integrator.FORM_SIGNATURE)
            position = _apply_form(function, position, _collect_values(effect, form))
    return position


def _apply_form(function: Any, position: Array, values: Array) -> Array:
    now, memory, reading = np.zeros(INPUT_COUNT), np.zeros(MAX_STATES), np.empty(len(position))
    for i, x in enumerate(position):
        now[X] = x
        reading[i] = function(now, memory, values, memory)
    return reading


def _collect_values(effect: ActiveEffect, form: AlternativeForm) -> Array:
    values = [effect.parameters[quantity.symbol] for quantity in form.parameters]
    return np.array(values + [0.0] * (MAX_PARAMETERS - len(values)))


def _return_zero(now: Any, memory: Any, values: Any, rate: Any) -> float:
    return 0.0


class _CompiledForms(NamedTuple):
    """Forms as the compiled integrator takes them, padded to their largest number."""

    functions: tuple[FixedAddress, FixedAddress, FixedAddress]
    places: Any
    values: Array
    exponents: Array


def _compile_forms(forms: Sequence[AlternativeForm], effects: Sequence[ActiveEffect]) -> _CompiledForms:
    empty = states.MAX_FORMS - len(forms)
    functions = [form.function for form in forms] + [_return_zero] * empty
    first, second, third = (
        FixedAddress(compile_function(function, integrator.FORM_SIGNATURE), integrator.FORM_TYPE)
        for function in functions
    )
    places = np.array([int(form.place) for form in forms] + [int(Place.NONE)] * empty, np.int64)
    values, exponents = np.zeros((states.MAX_FORMS, MAX_PARAMETERS)), np.zeros((states.MAX_FORMS, 3))
    for i, (form, effect) in enumerate(zip(forms, effects, strict=True)):
        values[i], exponents[i] = _collect_values(effect, form), form.exponents
    return _CompiledForms((first, second, third), places, values, exponents)


def _make_constants(
    scenario: Scenario, law: Array, forms: Sequence[AlternativeForm], effects: Sequence[ActiveEffect]
) -> Array:
    k = np.zeros(states.CONSTANT_COUNT)
    k[: Z_SATURATION + 1] = make_rig_constants(scenario, law)
    k[states.MAX_FORM_RATE] = compute_rig_rate(scenario, law)
    for form, effect in zip(forms, effects, strict=True):
        is_mounting = form.place is Place.MOUNTING
        k[states.MOUNTING_RATE if is_mounting else states.MAX_FORM_RATE] += form.max_rate(
            *effect.parameters.values()
        )
        k[states.HAS_MOUNTING] += is_mounting
    return k


def _make_rest_states(law: Array, k: Array, displacement: float, drive: float) -> Array:
    state = np.zeros(states.STATE_COUNT)
    position = displacement - k[ACTUATOR_COMPLIANCE] * law[11] * (displacement - law[13])
    state[[states.COMMAND, states.POSITION, states.Y, states.DAMPER]] = displacement, position, position, position
    state[[states.FIELD, states.OUTPUT]] = drive
    state[states.TEMPERATURE] = k[AMBIENT]
    return state
