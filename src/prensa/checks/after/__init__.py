"""Checks of answers: warnings about their quality, means over a passage."""
