"""Live data and true state, measured in a real browser on a complete bench with the simulated rig."""
