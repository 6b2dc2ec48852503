"""A camera behind a lenslet array: its raw pictures become the views of a profile."""
