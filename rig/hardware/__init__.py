"""The only place that knows drivers and simulation: `opening` from a profile, `find` without one.

Nothing is imported here: a list of what is plugged in must not wait for what opening needs.
"""
