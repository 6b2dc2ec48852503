"""Other people's formats, written and read; each writer is verified by its own reader."""
