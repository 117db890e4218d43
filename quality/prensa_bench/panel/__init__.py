"""Value of each special mechanism of the solver: the panel runs its problems with it and without."""
