"""A stage behind a program of the user's own."""
