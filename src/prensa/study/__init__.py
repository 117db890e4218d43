"""Many runs of one case: sweeps over values, scatter, convergence studies."""
