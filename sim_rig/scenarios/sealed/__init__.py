"""Effects as the trial plays them: for each of the library's names another form, and some that it has no name for.

Nothing that identifies or diagnoses may import this package.
"""

from sim_rig.scenarios.sealed.arctan_saturation import ARCTAN_SATURATION
from sim_rig.scenarios.sealed.arrhenius_heating import ARRHENIUS_HEATING
from sim_rig.scenarios.sealed.bessel_delay import BESSEL_DELAY
from sim_rig.scenarios.sealed.closing_joint import CLOSING_JOINT
from sim_rig.scenarios.sealed.coercive_remanence import COERCIVE_REMANENCE
from sim_rig.scenarios.sealed.eddy_ladder import EDDY_LADDER
from sim_rig.scenarios.sealed.fan_step import FAN_STEP
from sim_rig.scenarios.sealed.floor_vibration import FLOOR_VIBRATION
from sim_rig.scenarios.sealed.form import Form, Place
from sim_rig.scenarios.sealed.hanging_valve import HANGING_VALVE
from sim_rig.scenarios.sealed.loose_bolt import LOOSE_BOLT
from sim_rig.scenarios.sealed.lugre_friction import LUGRE_FRICTION
from sim_rig.scenarios.sealed.mass_with_mode import MASS_WITH_MODE
from sim_rig.scenarios.sealed.rubber_stop import RUBBER_STOP
from sim_rig.scenarios.sealed.squeeze_film_play import SQUEEZE_FILM_PLAY
from sim_rig.scenarios.sealed.sticking_seal import STICKING_SEAL
from sim_rig.scenarios.sealed.swelling_hum import SWELLING_HUM
from sim_rig.scenarios.sealed.switching_pickup import SWITCHING_PICKUP
from sim_rig.scenarios.sealed.thermal_gas import THERMAL_GAS
from sim_rig.scenarios.sealed.transition_orifice import TRANSITION_ORIFICE
from sim_rig.scenarios.sealed.uneven_winding import UNEVEN_WINDING
from sim_rig.scenarios.sealed.valve_areas import VALVE_AREAS
from sim_rig.scenarios.sealed.wandering_drift import WANDERING_DRIFT

FORMS: dict[str, Form] = {
    form.form: form
    for form in (
        ARCTAN_SATURATION,
        COERCIVE_REMANENCE,
        EDDY_LADDER,
        THERMAL_GAS,
        LUGRE_FRICTION,
        TRANSITION_ORIFICE,
        VALVE_AREAS,
        ARRHENIUS_HEATING,
        RUBBER_STOP,
        SQUEEZE_FILM_PLAY,
        CLOSING_JOINT,
        MASS_WITH_MODE,
        BESSEL_DELAY,
        WANDERING_DRIFT,
        SWELLING_HUM,
        UNEVEN_WINDING,
        STICKING_SEAL,
        HANGING_VALVE,
        SWITCHING_PICKUP,
        LOOSE_BOLT,
        FAN_STEP,
        FLOOR_VIBRATION,
    )
}
"""Every sealed form by its own name."""

__all__ = ["FORMS", "Form", "Place"]
