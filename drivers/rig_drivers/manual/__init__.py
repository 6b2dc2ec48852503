"""No stage: a person puts the board where it is asked for."""
