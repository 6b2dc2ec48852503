"""Live depth: from the camera's multi-views to maps of distance."""
