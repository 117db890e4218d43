"""Results of a run: increments, forces, the energy balance."""
