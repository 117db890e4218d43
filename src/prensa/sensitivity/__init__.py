"""Derivatives of a run by the parameters of its case: exact ones of the discrete solution, increment by increment."""
