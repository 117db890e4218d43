"""Enforcements of the contact conditions, one a file. Whatever stands here is an ``enforcement`` of the case file."""
