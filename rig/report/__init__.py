"""The sweep report: one self-contained HTML file that says whether the numbers are good."""

from rig.report.write import write_report

__all__ = ["write_report"]
