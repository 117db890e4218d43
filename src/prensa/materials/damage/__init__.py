"""Damage laws, one a file: being here is being known (`prensa.registry`)."""
