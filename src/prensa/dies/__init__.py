"""What a run does to its tools: loads along their outlines, wear, stresses of the dies."""
