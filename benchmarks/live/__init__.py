"""How fast a live frame is: its parts timed beside OpenCV's matchers in one process."""
