"""Several cameras as one multi-view camera: frames paired by the time at which they were taken."""
