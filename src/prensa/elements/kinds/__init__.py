"""Elements, one idea a file. Whatever stands here is an ``element`` of the case file."""
