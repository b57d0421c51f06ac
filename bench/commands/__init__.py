"""The bench's own commands, one file each; heavy imports happen when they are called."""
