"""A specimen with sealed forms on its actuator: a `Plant` that the rest of the rig cannot tell from the other."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from sim_rig import sealed_march as march
from sim_rig import sealed_states as at
from sim_rig.compiled import Array, compiled
from sim_rig.constants import fastest_of_the_rig, of_the_rig
from sim_rig.errors import PlantError
from sim_rig.plant import Plant, Truth, blocks_in
from sim_rig.scenario import Scenario
from sim_rig.scenarios.sealed.form import MEMORY, NOW, VALUES, Form, Place, X
from sim_rig.sealed_effects import form_of, size
from sim_rig.settings import EffectInPlay
from sim_rig.states import AMBIENT, COMPLIANCE, SATURATED

_STANDING = 0.2
"""[s] for which the specimen has stood when a run begins: filters are settled."""


class SealedPlant(Plant):
    """One specimen with sealed forms, moved by ``advance`` or ``play``.

    It starts at rest at its first commanded position, the loop relaxed, the field at its drive, the forms'
    memories empty but for a moment of standing still.
    """

    def __init__(self, scenario: Scenario, displacement: float = 0.0, drive: float = 0.0) -> None:
        """Settle the specimen of a scenario at a displacement [m] and a drive [V or A].

        Raises:
            PlantError: it has no finite force there.
        """
        played = [effect for effect in scenario.sealed if size(effect) != 0.0]
        forms = [form_of(effect) for effect in played]
        self._law = np.array(scenario.parameters)
        self._forms = _as_played(forms, played)
        self._constants = _constants(scenario, self._law, forms, played)
        self._command, self._samples = displacement, 0
        self._now, self._time = np.zeros(NOW), -_STANDING
        self._states = _at_rest(self._law, self._constants, displacement, drive)
        dt = 1e-3
        count = round(_STANDING / dt)
        self.play(dt, np.full(count + 1, displacement), np.full(count, drive))
        # The moment of standing was no part of the run.
        self._time, self._samples = 0.0, 0
        self._states[at.PATH] = 0.0

    def play(self, dt: float, command: Array, drive: Array) -> Truth:
        """Move on through M samples of dt [s], as `Plant.play` says."""
        count, blocks = len(drive), blocks_in(dt)
        force, position, output = np.empty(count * blocks), np.empty(count * blocks), np.empty(count)
        damper, states = np.empty((count, 2)), np.empty((count, at.STATES))
        done = march.march(
            self._states, self._now, self._time, np.ascontiguousarray(command, float),
            np.ascontiguousarray(drive, float), dt / blocks, blocks, self._constants, self._law,
            *self._forms.acts, self._forms.places, self._forms.values, self._forms.weights,
            force, position, output, damper, states,
        )  # fmt: skip
        if done < count:
            raise PlantError(
                f"the specimen runs away {(self._samples + done) * dt:.3f} s into its motion, at "
                f"{states[done, at.POSITION]:.4g} m: no finite force; check damper, forms and stroke"
            )
        self._command, self._samples = float(command[-1]), self._samples + count
        self._time += count * dt
        return Truth(
            position=position,
            force=force,
            output=output,
            damper_displacement=damper[:, 0],
            damper_velocity=damper[:, 1],
            y=states[:, at.Y],
            z=states[:, at.Z],
            field=states[:, at.FIELD],
            temperature=states[:, at.TEMPERATURE],
        )


def plant_for(scenario: Scenario, displacement: float = 0.0, drive: float = 0.0) -> Plant:
    """The specimen of a scenario, at rest at a displacement [m] and a drive [V or A].

    Raises:
        PlantError: it has no finite force there.
    """
    return (SealedPlant if scenario.sealed else Plant)(scenario, displacement, drive)


def displacement_read(scenario: Scenario, position: Array) -> Array:
    """What the displacement channel makes of the actuator's position (K,) [m]."""
    for effect in scenario.sealed:
        form = form_of(effect)
        if form.place is Place.POSITION and size(effect) != 0.0:
            position = _read(compiled(form.act, march.ACT_SIGNATURE), position, _values(effect, form))
    return position


def _read(act: Any, position: Array, values: Array) -> Array:
    now, memory, read = np.zeros(NOW), np.zeros(MEMORY), np.empty(len(position))
    for i, x in enumerate(position):
        now[X] = x
        read[i] = act(now, memory, values, memory)
    return read


def _values(effect: EffectInPlay, form: Form) -> Array:
    given = [effect.parameters[quantity.symbol] for quantity in form.parameters]
    return np.array(given + [0.0] * (VALUES - len(given)))


def _idle(now: Any, memory: Any, values: Any, rate: Any) -> float:
    return 0.0


class _Forms(NamedTuple):
    """The forms as the compiled march takes them, filled up to the most that there can be."""

    acts: tuple[Any, Any, Any]
    places: Any
    values: Array
    weights: Array


def _as_played(forms: Sequence[Form], effects: Sequence[EffectInPlay]) -> _Forms:
    empty = at.MOST_FORMS - len(forms)
    first, second, third = (compiled(act, march.ACT_SIGNATURE) for act in [f.act for f in forms] + [_idle] * empty)
    places = np.array([int(f.place) for f in forms] + [int(Place.NOWHERE)] * empty, np.int64)
    values, weights = np.zeros((at.MOST_FORMS, VALUES)), np.zeros((at.MOST_FORMS, 3))
    for i, (form, effect) in enumerate(zip(forms, effects, strict=True)):
        values[i], weights[i] = _values(effect, form), form.weights
    return _Forms((first, second, third), places, values, weights)


def _constants(scenario: Scenario, law: Array, forms: Sequence[Form], effects: Sequence[EffectInPlay]) -> Array:
    k = np.zeros(at.CONSTANTS)
    k[: SATURATED + 1] = of_the_rig(scenario, law)
    k[at.FASTEST] = fastest_of_the_rig(scenario, law)
    for form, effect in zip(forms, effects, strict=True):
        connects = form.place is Place.CONNECTION
        k[at.CONTACT if connects else at.FASTEST] += form.fastest(*effect.parameters.values())
        k[at.CONNECTED] += connects
    return k


def _at_rest(law: Array, k: Array, displacement: float, drive: float) -> Array:
    states = np.zeros(at.STATES)
    place = displacement - k[COMPLIANCE] * law[11] * (displacement - law[13])
    states[[at.COMMAND, at.POSITION, at.Y, at.DAMPER]] = displacement, place, place, place
    states[[at.FIELD, at.OUTPUT]] = drive
    states[at.TEMPERATURE] = k[AMBIENT]
    return states
