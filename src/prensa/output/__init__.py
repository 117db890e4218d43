"""Output of a run: tables, fields, checkpoints, pictures and the report. Reads `Increment` and nothing deeper."""
