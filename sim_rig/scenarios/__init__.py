"""Scenarios that ship with the rig."""
