"""A camera that gives depth: what programs loop over, the public Python API.

Nothing is imported here: `import rig` must not wait for arrays.
"""
