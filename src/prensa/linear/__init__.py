"""Linear algebra: factorisations, reduction by constraints, multipliers, condensation, threads."""
