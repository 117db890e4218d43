"""Checks of iterates and of converged increments."""
