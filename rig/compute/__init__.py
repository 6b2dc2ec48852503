"""Machine code: the door to numba, and kernels in bands on two threads."""
