"""What a run leaves behind: tables, fields, checkpoints, pictures and the report. Reads `Increment` and nothing deeper."""
