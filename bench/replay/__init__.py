"""Plays a log back: its raw frames through the decoders that made it, its samples to a live view."""
