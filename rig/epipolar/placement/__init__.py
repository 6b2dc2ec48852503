"""Where the views really are, against where they were told to be."""
