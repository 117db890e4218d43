"""Friction laws, one a file: description, checks, bound. Whatever stands here is a ``friction`` of the case file."""
