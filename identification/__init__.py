"""Learns the damper from recordings: log in, parameters and their intervals out. Never touches a wire."""
