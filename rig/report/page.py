"""The page: figures and tables in the order in which an engineer asks."""

import json
from collections.abc import Callable, Mapping
from importlib.resources import files
from importlib.resources.abc import Traversable
from typing import cast

import numpy as np
from jinja2 import Environment, StrictUndefined

from rig.curve import CurveFit
from rig.database import Store
from rig.report import numbers
from rig.report.curve_plots import holdout_figure, residual_figure, slope_figure
from rig.report.epi import board_epis
from rig.report.epi_plots import epi_figure
from rig.report.evidence import Evidence, gather
from rig.report.narrow import as_cards
from rig.report.picture_plots import corner_figure, failure_figure
from rig.report.scatter import EstimatorGap, direction_pairs, estimator_gaps, repeatability
from rig.report.stop_plots import estimator_figure, repeat_figure, temperature_figure
from rig.report.times import times_text
from rig.secrets import HIDDEN, is_secret, value_without_secrets, without_secrets
from rig.sweep.conclude import SweepResult
from rig.sweep.misses import misses
from rig.sweep.request import sweep_setup

TEMPLATE, STYLE = "report.html.j2", "page.css"


def report_html(store: Store, result: SweepResult) -> str:
    """Return the report as one HTML file that needs nothing else.

    Raises:
        StoreError: the sweep, its curve or a frame is missing or damaged.
    """
    return _render(gather(store, result))


def _render(evidence: Evidence) -> str:
    result = evidence.result
    fit, curve = result.fit, result.fit.best
    gaps = estimator_gaps(result.stops, curve, evidence.profile.quality.holdout_max_pct)
    return render_template(
        files("rig.report") / TEMPLATE,
        evidence=evidence,
        sweep=evidence.sweep,
        profile=evidence.profile,
        config=sweep_setup(evidence.profile).config,
        result=result,
        times=None if result.times is None else times_text(result.times),
        headline=str(result.headline).replace("+-", "±"),
        fit=fit,
        curve=curve,
        focus=_focus(fit),
        parameters=_parameters(fit),
        verdicts=_verdicts(fit),
        gates=result.gates,
        problems=[stop.problem for stop in result.stops if stop.problem is not None],
        misses=misses(result.stops),
        repeatability=repeatability(result.stops, curve),
        pairs=direction_pairs(result.stops, curve),
        alarms=[gap for gap in gaps if gap.alarms],
        counts={stop.stop.index: _count(evidence, stop.stop.index) for stop in result.stops},
        degrees=[s.temperature_degc for s in evidence.samples if s.temperature_degc is not None],
        figures=_figures(evidence, gaps),
    )


def render_template(template: Traversable, **values: object) -> str:
    """Fill a template; all pages have one style, and the filters of a report.

    Args:
        template: its file.
        values: what it shows, by name; a name that it misses is an error.
    """
    environment = Environment(
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=lambda value: numbers.NOT_KNOWN if value is None else value,
    )
    environment.filters |= _FILTERS
    style = (files("rig.report") / STYLE).read_text("utf-8")
    page = environment.from_string(template.read_text("utf-8")).render(style=style, **values)
    return as_cards(page)


def flat_fields(content: Mapping[str, object], prefix: str = "") -> list[tuple[str, str]]:
    """Return nested values as lines of dotted key and text."""
    lines: list[tuple[str, str]] = []
    for key, value in content.items():
        if is_secret(key):
            lines.append((f"{prefix}{key}", HIDDEN))
        elif isinstance(value, Mapping):
            lines += flat_fields(cast("Mapping[str, object]", value), f"{prefix}{key}.")
        else:
            shown = numbers.NOT_KNOWN if value is None else without_secrets(str(value))
            lines.append((f"{prefix}{key}", shown))
    return lines


def _pretty(content: Mapping[str, object]) -> str:
    return json.dumps(value_without_secrets(content), indent=2, ensure_ascii=False)


_FILTERS: dict[str, Callable[..., object]] = {
    "fixed": numbers.fixed,
    "signed": numbers.signed,
    "digits": numbers.digits,
    "fields": flat_fields,
    "pretty": _pretty,
}


def _figures(evidence: Evidence, gaps: list[EstimatorGap]) -> dict[str, str | None]:
    result, profile, pictures = evidence.result, evidence.profile, evidence.pictures
    fit = result.fit
    limit_pct = profile.quality.holdout_max_pct
    points = tuple(stop.point for stop in result.stops if stop.point is not None)
    epis = [(p.sample.reached_mm, board_epis(evidence.range_px, p)) for p in pictures]
    return {
        "slope": slope_figure(fit, points),
        "residuals": residual_figure(fit),
        "holdout": fit.holdout and holdout_figure(fit, fit.holdout, limit_pct),
        "repeat": repeat_figure(evidence),
        "estimators": estimator_figure(gaps, limit_pct),
        "corners": corner_figure(pictures, profile.reference) if pictures else None,
        "failures": failure_figure(evidence.failures) if evidence.failures else None,
        "epi": epi_figure(epis) if epis else None,
        "temperature": temperature_figure(evidence.samples),
    }


def _focus(fit: CurveFit) -> str | None:
    curve = fit.best
    if curve.focus_mm is None or curve.focus_sigma_mm is None:
        return None
    return numbers.with_sigma(curve.focus_mm, curve.focus_sigma_mm)


def _parameters(fit: CurveFit) -> list[tuple[str, str]]:
    """Names of the fitted parameters, and their values with k = 2."""
    curve = fit.best
    sigmas = np.sqrt(np.diag(np.array(curve.covariance))).tolist()
    values = curve.law.fitted_values().tolist()
    return [
        (name, numbers.with_sigma(value, sigma))
        for name, value, sigma in zip(curve.law.fitted, values, sigmas, strict=True)
    ]


def _verdicts(fit: CurveFit) -> dict[str, str]:
    """Why each model was taken or not; the candidates are ordered by simplicity."""
    models = [candidate.curve.model for candidate in fit.candidates]
    place = models.index(fit.best.model)
    chosen = fit.candidates[place]
    verdicts = {chosen.curve.model: "chosen: the simplest that is as good as the best"}
    for candidate in fit.candidates[:place]:
        verdicts[candidate.curve.model] = "simpler, but misses by over one standard error more"
    for candidate in fit.candidates[place + 1 :]:
        worse = candidate.cv_rms_px > chosen.cv_rms_px
        verdicts[candidate.curve.model] = (
            "misses more" if worse else "misses less, but by no more than one standard error"
        )
    return verdicts


def _count(evidence: Evidence, stop: int) -> int:
    return sum(sample.stop.index == stop for sample in evidence.samples)
