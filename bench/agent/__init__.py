"""The rig agent: the one process that touches the instruments, and how others speak with it."""
