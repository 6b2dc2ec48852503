"""Stored frames as a camera: folders of pictures, recordings and videos."""
