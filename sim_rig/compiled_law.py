"""The damper's law as machine code, for every march of this room."""

from identification.damper import law
from sim_rig.compiled import compiled

at_field = compiled(law.at_field)
field_rate = compiled(law.field_rate)
inner_velocity = compiled(law.inner_velocity)
hysteresis_rate = compiled(law.hysteresis_rate)
damper_force = compiled(law.force)
