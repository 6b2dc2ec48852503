"""How many one-operator faults of the source the tests notice: `python -m benchmarks.mutants`.

`operators` lists the faults that one can make, `draw` picks some with a fixed seed, `recorder`
notes which test runs which line, `covering` names the tests of a line, `trial` tries one fault in
a copy of the tree, and `equivalent` knows the survivors that change nothing.
"""
