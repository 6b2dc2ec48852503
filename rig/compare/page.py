"""The page of a comparison: one HTML file that needs nothing else."""

from importlib.resources import files

from rig.compare.baselines import OURS
from rig.compare.comparison import Comparison, distance_scores
from rig.compare.distances import WITH_PLANE
from rig.compare.plots import error_figure, picture_figure
from rig.report.page import render_template

TEMPLATE = "compare.html.j2"


def comparison_html(comparison: Comparison) -> str:
    """Return the page of a comparison."""
    scores = distance_scores(comparison.distances)
    return render_template(
        files("rig.compare") / TEMPLATE,
        comparison=comparison,
        profile=comparison.profile,
        frames=comparison.frames,
        scores=scores,
        by_name={score.method: score for score in scores},
        ours=OURS.name,
        with_plane=WITH_PLANE,
        pictures=picture_figure(comparison.frames, comparison.unit),
        errors=error_figure(comparison.distances) if scores else None,
    )
