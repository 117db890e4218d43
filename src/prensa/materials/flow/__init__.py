"""Flow curves, one a file: description, checks, stress. Whatever stands here is a ``flow`` of the case file."""
