"""Checks of a problem before, of increments during, and of answers after a run."""
