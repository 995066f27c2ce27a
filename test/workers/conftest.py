"""Fixtures of the tests of workers."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from workers.cluster import Cluster


@pytest.fixture
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    """Give a cluster of two workers."""
    pytest.importorskip("distributed", reason="the extra `dask` is not installed")
    made = Cluster(tmp_path_factory.mktemp("cluster"))
    yield made
    made.kill()
