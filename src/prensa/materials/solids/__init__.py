"""Materials, one a file: description, checks, law. Whatever stands here is a ``material`` of the case file."""
