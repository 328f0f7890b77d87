"""What a map does not say plainly is blocked or unknown, never free: the check ``maps``, commit size."""

from __future__ import annotations

import pytest

from lampyris.selfcheck import maps, registry, runner
from lampyris.selfcheck.check import Ask

pytestmark = pytest.mark.skipif("maps" in registry.NAMES, reason="asked with the others, in test_promises")


@pytest.mark.parametrize("kind", ["closed", "closed-ros"])
def test_only_what_is_plainly_free_is_free(kind: str) -> None:
    result = runner.run(maps.CHECK, Ask(), runner.Range(only=kind))
    assert result.holds, [f.what for f in result.outcome.failures[:5]]
