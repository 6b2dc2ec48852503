"""Everything in this folder needs the extra `oak`."""

from importlib.util import find_spec

import pytest


def pytest_pycollect_makemodule() -> None:
    if find_spec("depthai") is None:
        pytest.skip("depthai is not installed: pip install -e '.[oak]'", allow_module_level=True)
