"""Inputs from outside, changed at random: read, or refused in one line."""
