"""The raw picture of a simulated camera behind a lenslet array, in closed form."""
