"""Tools, one a file: description, checks, geometry, outline. Whatever stands here is a ``type`` of a tool of the case file."""
