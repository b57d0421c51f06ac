"""The sequencer: plays a compiled method on actuator and coil amplifier."""
