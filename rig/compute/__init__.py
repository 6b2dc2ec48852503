"""Machine code: the door to numba, and kernels in bands on all cores that there are."""
