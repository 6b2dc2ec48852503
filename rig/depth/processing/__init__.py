"""What may be done to slopes and depth once they are measured; every part is off by default."""
