"""Settings that every test may change are put back after it."""

import pytest


@pytest.fixture(autouse=True)
def _settings():
    import pleinair
    from pleinair import _core

    yield
    pleinair.set_num_threads(None)
    _core.force_simd_level(None)
