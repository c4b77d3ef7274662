"""Checks of a whole course against itself."""
