"""Errors that a person can act on: each says what, where and what to try."""

from __future__ import annotations


class PrensaError(Exception):
    """Base of every error that prensa raises on purpose; its text is meant for the user."""
