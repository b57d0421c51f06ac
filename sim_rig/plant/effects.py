"""Active effects of a scenario as compiled functions and constants of the plant, by the action of their forms."""

import numpy as np

from identification.damper.effects import Action, Form, compute_elongation, connection, step_response
from sim_rig.plant.jit import (
    Array,
    BinaryFunction,
    QuaternaryFunction,
    ScaleFunction,
    TernaryFunction,
    add_functions,
    bind_all_but_third,
    bind_energy,
    bind_first,
    bind_first_three,
    bind_first_two,
    bind_memory,
    bind_motion,
    bind_values,
    compose_functions,
    multiply_functions,
    no_memory,
    rigid_mounting,
)
from sim_rig.scenario import Scenario

ParameterValues = tuple[float, ...]

_SETTLED = 1e-6
"""Part of a change that may still be missing when its step response counts as settled [1]."""


class EffectFunctions:
    """Active effects of a scenario, sorted by action."""

    def __init__(self, scenario: Scenario) -> None:
        self._forms = [
            (form, tuple(effect.parameters[q.symbol] for q in form.parameters))
            for effect in scenario.effects
            for form in (effect.effect.find_form(effect.form),)
        ]

    def select(self, *actions: Action) -> list[tuple[Form, ParameterValues]]:
        """Return the forms with one of these actions, with their values."""
        return [(form, values) for form, values in self._forms if form.action in actions]

    def sum_values(self, action: Action) -> float:
        """Return the sum over the forms of an action that is one number, such as a delay [s]."""
        return float(sum(form.function(*values) for form, values in self.select(action)))

    def sum_connections(self) -> tuple[float, float, float, float, float]:
        """Return the constants of the compliant mounting: those of a form with the action "connection"."""
        parts = [form.function(*values) for form, values in self.select("connection")]
        compliance, gap, hardening, film, stiffness_ratio = (
            float(sum(part[k] for part in parts)) for k in range(5)
        )
        return compliance, gap, hardening, film, stiffness_ratio

    def tabulate_elongation(self, least_compliance: float) -> Array:
        """Return the elongation (G,) of the mounting [m] as a table; empty unless a defined effect gives one.

        Args:
            least_compliance: least slope of the table [m/N].
        """
        defined = self.select("elongation_function")
        if not defined:
            return np.empty(0)
        compliance, gap, hardening, _, stiffness_ratio = self.sum_connections()
        spring = [
            compute_elongation(float(f), compliance, gap, hardening, stiffness_ratio) for f in connection.FORCES
        ]
        added = [form.function({"force": connection.FORCES}, *values) for form, values in defined]
        return np.asarray(connection.tabulate_elongation(np.sum([spring, *added], axis=0), least_compliance))

    def compute_response_weights(self, action: Action, dt: float) -> list[Array]:
        """Return the weights of the last values, dt [s] apart, in each step response with an action."""
        return [
            step_response.compute_weights(form.function, values, dt, _SETTLED)
            for form, values in self.select(action)
        ]

    def get_coil_lag(self) -> tuple[float, float, float, float]:
        """Return dead time [s], second lag [s], part of the field behind it [1] and number of such lags [1]."""
        lags = [form.function(*values) for form, values in self.select("drive_delay")]
        dead, lag, part, layers = lags[0] if lags else (0.0, 0.0, 1.0, 1)
        return float(dead), float(lag), float(part), float(layers)

    def make_parallel_force(self) -> QuaternaryFunction:
        """Return the force [N] over displacement [m], velocity [m/s], lip deflection [1] and gas position [m]."""
        memoryless = [bind_first_two(form.function, values) for form, values in self.select("parallel_force")]
        hysteretic = [bind_first_three(form.function, values) for form, values in self.select("hysteretic_force")]
        relaxing = [bind_all_but_third(form.function, values) for form, values in self.select("relaxation_force")]
        return add_functions(memoryless + hysteretic + relaxing)

    def get_bristles(self) -> tuple[float, float, float]:
        """Return the rate [1/m] at which a seal's lip deflects, its peak [1] and its Stribeck speed [m/s].

        The peak is the further deflection while sticking, over that of fast sliding.
        """
        for form, values in self.select("hysteretic_force"):
            named = form.name_values(values)
            return 1.0 / named["presliding_distance"], named.get("peak_ratio", 0.0), named["stribeck"]
        return 0.0, 0.0, 1.0

    def get_exchange_rate(self) -> float:
        """Return the rate [1/s] at which gas takes the temperature of its wall."""
        return self._get_rate("relaxation_force", "exchange_time")

    def _get_rate(self, action: Action, constant: str) -> float:
        """Return one over the named time constant [s] or length [m] of the effect with this action, else 0."""
        for form, values in self.select(action):
            return 1.0 / form.name_values(values)[constant]
        return 0.0

    def make_backlash_map(self) -> BinaryFunction:
        """Return the damper's new displacement [m] over its previous one and the actuator's position."""
        followers = self.select("displacement_backlash")
        return bind_values(followers[0][0].function, followers[0][1]) if followers else rigid_mounting

    def make_scale_factors(self) -> ScaleFunction:
        """Return the factors of alpha, c0 and c1 over displacement [m], velocity [m/s] and energy [J]."""
        by_motion = [bind_motion(form.function, values) for form, values in self.select("scaling")]
        return multiply_functions(
            by_motion + [bind_energy(form.function, values) for form, values in self.select("softening")]
        )

    def make_field_map(self) -> BinaryFunction:
        """Return the field that the fluid sees over the coil's field and the remanence [V or A]."""
        maps = [
            bind_values(form.function, values) if form.memory else bind_first(form.function, values)
            for form, values in self.select("field", "field_memory")
        ]
        return compose_functions(maps)

    def make_field_memory(self) -> TernaryFunction:
        """Return the new memory of the iron over the previous one, the change of the field and its position."""
        for form, values in self.select("field_memory"):
            if form.memory is not None:
                return bind_memory(form.memory, values)
        return no_memory

    def count_field_memories(self) -> int:
        """Return the number of memories of the iron, at least one."""
        return max((form.memories for form, _ in self.select("field_memory")), default=1)

    def get_initial_rise(self) -> float:
        """Return the change to the first field, over that field, since the iron had no memory [1]."""
        for form, values in self.select("field_memory"):
            return form.name_values(values)["initial_rise"]
        return 0.0

    def get_cooling_rate(self) -> float:
        """Return the rate [1/s] at which the energy leaves the damper."""
        return self._get_rate("softening", "recovery_time")
