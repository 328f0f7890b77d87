"""Widgets for notebooks (the extra ``notebook``): ``lampyris.notebook.scrub(drive)``."""

from lampyris.notebook.widget import scrub as scrub

__all__ = ["scrub"]
