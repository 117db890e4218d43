"""New meshes during a run: when, how the state is transferred, how the run goes on."""
