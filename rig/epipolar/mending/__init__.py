"""What is wrong with the pictures of an instant, found from them and taken out."""
