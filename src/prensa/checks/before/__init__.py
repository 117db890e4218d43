"""Checks of the description, before anything is solved."""
