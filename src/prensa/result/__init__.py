"""What a run yields: increments, forces, the energy balance."""
