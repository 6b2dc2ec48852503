"""Between the raw pictures and the common frame: the target, the rectification, the resampling."""
