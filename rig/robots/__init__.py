"""Depth for robots: what ROS 2, Foxglove and Lichtblick want to see of a capture.

Both describe depth along +z of the rectified reference view, in m; rig counts depth along +z of the
reference camera itself, in mm. Here the one becomes the other.
"""
