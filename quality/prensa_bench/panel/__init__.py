"""What each special mechanism of the solver is worth: the panel runs its problems with it and without."""
