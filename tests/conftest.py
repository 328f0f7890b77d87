"""Fixtures that every room's tests share."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def movingai() -> Path:
    """The folder of MovingAI maps, which is not part of the project; its tests say so when it is absent."""
    shared = Path(os.environ.get("LAMPYRIS_SHARED") or ROOT.parent / "shared")
    folder = shared / "maps" / "movingai"
    if not folder.is_dir():
        pytest.skip(
            "the MovingAI maps are not here (set LAMPYRIS_SHARED to the folder that holds maps/movingai)"
        )
    return folder
