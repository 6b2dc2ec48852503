"""What every camera and every stage has to keep, as tests that any package can run.

    pytest --pyargs rig.testing -p my_devices.testing

runs both suites over the devices that two fixtures of that module name, `camera_case` and
`stage_case`. `rig.testing.test_camera` and `rig.testing.test_stage` run one of them; a test file
with such a fixture may import all names of a suite instead. Needs the extra `test`.
"""

import pytest

pytest.register_assert_rewrite("rig.testing.test_camera", "rig.testing.test_stage")

from rig.testing.cases import CameraCase, StageCase  # noqa: E402 - what follows is rewritten

__all__ = ["CameraCase", "StageCase"]
