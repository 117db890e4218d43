"""The discretised problem: interactions, loops and scatter, loads, the committed state."""
