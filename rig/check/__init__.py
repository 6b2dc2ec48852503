"""The pre-flight of a rig: what is measured, and whether it is good enough to sweep."""
