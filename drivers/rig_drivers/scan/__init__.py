"""One camera on one or two stages: a multi-view is a scan."""
