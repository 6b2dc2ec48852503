"""Conventions: camera frame x right, y down, z forward; pixel centres at integers.

Lengths in mm, angles in rad. Transforms read `world_from_cam`; pixels are `(x, y)`, arrays
`[row, col]`, and (0, 0) is the centre of the top-left pixel.
"""
