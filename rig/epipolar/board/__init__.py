"""The slope of a known board: the joint line fit over its edge pixels and all views."""
