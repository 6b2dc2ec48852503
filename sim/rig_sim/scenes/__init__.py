"""What stands before the cameras, apart from the board."""
