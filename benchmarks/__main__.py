"""Print every number of README and docs: main job, board fit, rectification, dense slopes, live."""

import numpy as np

from benchmarks import board_fit, calibration, main_job, opening, rectification, start
from benchmarks.live import __main__ as live
from benchmarks.slopes import __main__ as slopes

if __name__ == "__main__":
    main_job.main()
    opening.main()
    start.main()
    board_fit.main()
    calibration.main()
    rectification.main()
    np.seterr(invalid="ignore")
    slopes.main([])
    live.main([])
