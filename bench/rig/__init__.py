"""From instruments to bench samples: one thread a wire, one clock for all, every channel at the same instants."""
