"""The depth-slope curve: from the stops of a sweep to depth in mm with its sigma."""

from rig.curve.curve import Curve
from rig.curve.depth_error import DepthError
from rig.curve.field import FieldTerm
from rig.curve.field_fit import BoardTilt, FieldFit, fit_field
from rig.curve.fit import ALL_MODELS, Candidate, CurveFit, Rejected, fit_curve
from rig.curve.holdout import Headline, HoldoutError, depth_errors, headline
from rig.curve.law import Law, ModelName
from rig.curve.linear_laws import LinearLaw
from rig.curve.pixel_error import PixelSigma, pixel_errors
from rig.curve.points import CurvePoint
from rig.curve.residuals import Residual
from rig.curve.screening import BadStop

__all__ = [
    "ALL_MODELS",
    "BadStop",
    "BoardTilt",
    "Candidate",
    "Curve",
    "CurveFit",
    "CurvePoint",
    "DepthError",
    "FieldFit",
    "FieldTerm",
    "Headline",
    "HoldoutError",
    "Law",
    "LinearLaw",
    "ModelName",
    "PixelSigma",
    "Rejected",
    "Residual",
    "depth_errors",
    "fit_curve",
    "fit_field",
    "headline",
    "pixel_errors",
]
