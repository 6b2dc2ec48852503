"""Geometric calibration of a rig: from pictures of a target to a stored calibration.

    pictures (live, on the stage, recorded) -> sight -> solve -> conclude

`pictures` and `in_hand` take them, `album` keeps them as they are taken, `coverage` and `guide` say
what to show next, `sight` looks for the target, `solve` is a pure function of what they show.
"""
