"""The effects of a scenario as the compiled motion takes them: functions and single numbers, by how they act."""

from identification.damper.effects import EFFECTS, Action, Form
from sim_rig.compiled import (
    OfFour,
    OfTwo,
    Scales,
    chain_of,
    nothing,
    of_all_but_third,
    of_energy,
    of_first,
    of_first_three,
    of_first_two,
    of_motion,
    product_of,
    rigid,
    sum_of,
    with_values,
)
from sim_rig.scenario import Scenario

Values = tuple[float, ...]


class Effects:
    """The effects of a scenario, sorted by how they act."""

    def __init__(self, scenario: Scenario) -> None:
        self._played = [
            (form, tuple(effect.parameters[q.symbol] for q in form.parameters))
            for effect in scenario.effects
            for form in (EFFECTS[effect.name].form(effect.form),)
        ]

    def that(self, *acts: Action) -> list[tuple[Form, Values]]:
        """Those that act in certain ways, with their values."""
        return [(form, values) for form, values in self._played if form.acts in acts]

    def total(self, acts: Action) -> float:
        """Sum of what those give that are a single number: a delay [s], a lag [s], a give [m/N]."""
        return float(sum(form.act(*values) for form, values in self.that(acts)))

    def connection(self) -> tuple[float, float, float, float, float]:
        """What carries the damper, as ``Form`` says of "connection"."""
        parts = [form.act(*values) for form, values in self.that("connection")]
        give, gap, hardening, film, inside = (float(sum(part[k] for part in parts)) for k in range(5))
        return give, gap, hardening, film, inside

    def coil(self) -> tuple[float, float, float, float]:
        """From output to field: dead time [s], second lag [s], part behind it [1], such lags in a row [1]."""
        acting = [form.act(*values) for form, values in self.that("drive_delay")]
        dead, lag, part, layers = acting[0] if acting else (0.0, 0.0, 1.0, 1)
        return float(dead), float(lag), float(part), float(layers)

    def parallel(self) -> OfFour:
        """Force [N] over displacement [m], velocity [m/s], bend of a lip [1] and displacement that follows [m]."""
        plain = [of_first_two(form.act, values) for form, values in self.that("parallel_force")]
        bent = [of_first_three(form.act, values) for form, values in self.that("dragging_force")]
        relaxed = [of_all_but_third(form.act, values) for form, values in self.that("relaxing_force")]
        return sum_of(plain + bent + relaxed)

    def bristles(self) -> float:
        """Rate [1/m] over the way with which a seal's lip bends."""
        return self._rate("dragging_force", "bend")

    def exchange(self) -> float:
        """Rate [1/s] with which gas takes the temperature of its wall."""
        return self._rate("relaxing_force", "exchange")

    def _rate(self, acts: Action, constant: str) -> float:
        """Rate of the effect that acts so: one over its time constant [s], or length [m]; 0 without one."""
        for form, values in self.that(acts):
            return 1.0 / values[[q.symbol for q in form.parameters].index(constant)]
        return 0.0

    def follow(self) -> OfTwo:
        """Where the damper stands [m] over where it stood and where the actuator is."""
        followers = self.that("displacement_follower")
        return with_values(followers[0][0].act, followers[0][1]) if followers else rigid

    def scales(self) -> Scales:
        """Factors of alpha, c0 and c1 over displacement [m], velocity [m/s] and energy [J]."""
        moving = [of_motion(form.act, values) for form, values in self.that("scaling")]
        return product_of(moving + [of_energy(form.act, values) for form, values in self.that("softening")])

    def seen(self) -> OfTwo:
        """Field that the damper sees over the coil's own and what the iron remembers [V or A]."""
        maps = [
            with_values(form.act, values) if form.memory else of_first(form.act, values)
            for form, values in self.that("field", "field_memory")
        ]
        return chain_of(maps)

    def memory(self) -> OfTwo:
        """What the iron remembers after (remembered, change of the field)."""
        for form, values in self.that("field_memory"):
            if form.memory is not None:
                return with_values(form.memory, values)
        return nothing

    def cooling(self) -> float:
        """Rate [1/s] with which the energy leaves the damper."""
        return self._rate("softening", "recovery")
