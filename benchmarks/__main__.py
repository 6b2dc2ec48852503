"""Print every number that README and docs quote: the main job, the board fit, dense slopes."""

import numpy as np

from benchmarks import board_fit, main_job
from benchmarks.slopes import __main__ as slopes

if __name__ == "__main__":
    main_job.main()
    board_fit.main()
    np.seterr(invalid="ignore")
    slopes.main([])
