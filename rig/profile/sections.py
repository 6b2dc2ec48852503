"""The commented sections that new profiles are made of."""

HEAD = """\
# {description}. Written by `rig profile new`; lines that say MEASURE hold guesses.
# Next: rig check {name} --no-move, then rig check {name}, then rig sweep {name}.
{notes}name = "{name}"
description = "{description}"

# One view step, mm: the distance that x_steps and y_steps below are multiples of. MEASURE it once,
# between two lens centres; a calibration finds the rest.
pitch_mm = {pitch_mm}

# Where each lens centre is, in view steps right of and below the reference. MEASURE. Uneven spacing
# is an advantage: a repeating pattern then cannot look right at a wrong distance.
"""

CAMERA = {
    "v4l2": """\
[camera]
kind = "v4l2"
width_px = {width_px}
height_px = {height_px}
rate_hz = 30
pixel_format = "GREY"  # or Y10, Y12, Y16, YUYV, NV12, MJPG; MJPG is the last resort
exposure_s = 0.008     # locked; the white squares should reach 70 % of full scale
# gain = 16            # lock it too: the number that v4l2-ctl shows
# focus = 0            # only for lenses with autofocus: lock it
max_skew_s = 0.005     # a board that stands still allows more

# By view name. A path in /dev/v4l/by-path names the USB socket and stays; /dev/videoN does not.
[camera.devices]
{devices}
""",
    "oak": """\
[camera]
kind = "oak"
device = {device}        # id of the device; empty takes the only one there is
width_px = {width_px}
height_px = {height_px}
rate_hz = 10           # low is cool, and leaves bandwidth
exposure_s = 0.008     # locked; the white squares should reach 70 % of full scale
iso = 100
# lens_position = 130  # only for sensors with autofocus, and then needed
max_skew_s = 0.005

# By view name: the board socket of its sensor.
[camera.sockets]
{devices}
""",
}

_COMMON = """\
port = {port}{others}
travel_mm = [{near_mm}, {far_mm}]  # MEASURE: nearest and farthest distance of the board
distance_at_machine_zero_mm = {zero_mm}  # MEASURE: lens centre to board when the controller shows 0
direction = 1                # -1 if the controller counts towards the camera
speed_mm_s = 50.0
acceleration_mm_s2 = 200.0   # as in the controller; only for estimates of time
approach_mm = 2.0            # more than the play of the spindle: rig check measures it
may_move = false             # true when the lines above are MEASURED and the way is clear
"""

STAGE = {
    "grbl": """\
# GRBL 1.1, grblHAL, FluidNC: $22=1 (homing), $20=1 (soft limits), $130 (travel) must be set.
[stage]
kind = "grbl"
axis = "X"
"""
    + _COMMON,
    "zaber": """\
# Zaber ASCII protocol; the port is that of the first device of the chain.
[stage]
kind = "zaber"
device_address = 1
axis_number = 1
microstep_mm = 0.00049609375  # MEASURE, or see the data sheet: way of one microstep
"""
    + _COMMON,
    "marlin": """\
# Marlin 2 (the board of a 3D printer): homes with G28.
[stage]
kind = "marlin"
axis = "X"
"""
    + _COMMON,
}

SWEEP = """\
[target]
kind = "checkerboard"
columns = 9       # INNER corners, one less than squares
rows = 6
square_mm = 25.0  # MEASURE across ten squares: a print is rarely true

[sweep]
from_mm = {near_mm}
to_mm = {far_mm}
count = 17
samples = 5
settle_s = 0.4    # rig check says whether it is enough

# Slopes that the scene can have, px per view step: pitch_mm * focal_px / distance for cameras that
# look straight ahead, less the same at the focus distance for others. Narrow is faster and safer.
[slopes]
range_px = [{low_px}, {high_px}]

# A run that misses one of these ends with exit code 3. Without a geometric calibration be generous.
[quality]
holdout_rms_pct = 0.2
holdout_max_pct = 0.5
line_rms_px = 0.5 # corners beside their epipolar lines: `rig calibrate` makes the views rectified
"""
