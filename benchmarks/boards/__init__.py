"""Boards found, and refused with the right reason, over many rendered pictures with and without."""
