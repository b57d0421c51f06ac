"""Plays the hardware: the specimen, its sensors and their faults."""
