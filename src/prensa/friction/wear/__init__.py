"""Wear laws, one a file."""
