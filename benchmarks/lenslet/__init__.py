"""A lenslet camera: how well its lattice and views are known, and what they cost."""
