"""Targets on paper: one list of shapes, written as PDF, SVG or PNG at true size."""
