"""What ordinary scenes tell of the cameras: features that views share, and what fits them."""
