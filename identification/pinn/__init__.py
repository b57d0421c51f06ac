"""The physics-informed network: finds the damper's parameters by training, never by fitting a simulation."""
