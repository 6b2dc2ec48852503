"""Images of a rig, joined with the places of its views."""

import numpy as np

from rig.epipolar import RectifiedViews
from rig.frames import GreyImage
from rig.profile import Profile


def rectified_views(profile: Profile, images: GreyImage) -> RectifiedViews:
    """Join the images of one multi-view with the view positions of the profile.

    Args:
        profile: the rig; its views are in the order of the images.
        images: (V, H, W) grey, rectified to one common frame.

    Raises:
        SlopeError: the images do not fit the views.
    """
    return RectifiedViews(
        images=images,
        x_steps=np.array([view.x_steps for view in profile.views]),
        y_steps=np.array([view.y_steps for view in profile.views]),
        reference=profile.reference,
    )
