"""Settings of Sphinx; `make docs` calls it on the folder that `site/build.py` has put together."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

from PIL import Image, ImageChops
from sphinx_gallery.sorting import ExplicitOrder

import lampyris

os.environ.setdefault("MPLBACKEND", "Agg")
SITE = Path(__file__).resolve().parent

project = "lampyris"
author = "The lampyris founders"
project_copyright = "2026, the lampyris founders"
release = version = lampyris.__version__
root_doc = "index"
language = "en"

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "numpydoc",
    "sphinx_copybutton",
    "sphinx_design",
    "sphinx_external_toc",
    "sphinx_gallery.gen_gallery",
]
external_toc_path = str(SITE / "toc.yml")
exclude_patterns = ["gallery/src", "**/README.txt"]
nitpicky = False
maximum_signature_line_length = 88

myst_enable_extensions = ["colon_fence", "deflist"]
myst_heading_anchors = 4

autosummary_generate = True
autodoc_typehints = "none"
autodoc_preserve_defaults = True
autodoc_member_order = "bysource"
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False

html_theme = "furo"
html_title = "lampyris"
html_static_path = [str(SITE / "static")]
html_css_files = ["site.css"]
html_js_files = ["site.js"]
html_copy_source = False
html_show_sourcelink = False
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#1f5f4a", "color-brand-content": "#1a6b52"},
    "dark_css_variables": {"color-brand-primary": "#8fd3a8", "color-brand-content": "#8fd3a8"},
}
templates_path = [str(SITE / "templates")]

GALLERY = SITE.parent / "examples" / "gallery"
SOURCE = SITE.parent / "build" / "site" / "source"  # where build.py puts the pages together
SECTIONS = ("paths", "maps", "moving", "speeds", "poses", "fleets", "studies")
THUMBNAIL = (480, 360)

sphinx_gallery_conf = {
    "examples_dirs": [str(GALLERY)],
    "subsection_order": ExplicitOrder([os.path.relpath(GALLERY / name, SOURCE) for name in SECTIONS]),
    "gallery_dirs": ["gallery"],
    "filename_pattern": r"/plot_",
    "within_subsection_order": "FileNameSortKey",
    "plot_gallery": "LAMPYRIS_NO_GALLERY" not in os.environ,
    "abort_on_example_error": True,
    "download_all_examples": False,
    "min_reported_time": 1000,
    "remove_config_comments": True,
    "show_memory": False,
    "reset_modules": ("matplotlib",),
    # Twice as large as they are shown: their white margins are cut off afterwards.
    "thumbnail_size": (2 * THUMBNAIL[0], 2 * THUMBNAIL[1]),
    "default_thumb_file": str(SITE.parent / "docs" / "img" / "env-1.png"),
}
# Lists of public names make a page for each, beside the table of contents in toc.yml.
suppress_warnings = ["config.cache", "etoc.toctree"]

EMPTY_HEAD = re.compile(r'<th class="head[^"]*"><p></p></th>')
LONG_SIGNATURE = re.compile(r'<dl>\s*((?:<dd><em class="sig-param">.*?</em>,?</dd>\s*)+)</dl>', re.DOTALL)


def _readable(app: Any, page: str, template: str, context: dict[str, Any], doctree: Any) -> None:
    """What a screen reader would announce wrongly: an empty heading of a table becomes a plain cell, and a
    signature of several lines, a list of definitions without terms, becomes lines."""
    if "body" in context:
        body = EMPTY_HEAD.sub("<td></td>", context["body"])
        context["body"] = LONG_SIGNATURE.sub(_lines, body)


def _lines(found: re.Match[str]) -> str:
    lines = found[1].replace("<dd>", '<span class="sig-line">').replace("</dd>", "</span>")
    return f'<span class="sig-lines">{lines}</span>'


def _crop_thumbnails(app: Any, fault: Exception | None) -> None:
    """Cut off the white margins of the gallery's thumbnails, so that the pictures fill their frames."""
    for path in Path(app.outdir, "_images").glob("sphx_glr_plot_*_thumb.png"):
        with Image.open(path) as opened:
            image = Image.new("RGB", opened.size, "white")
            image.paste(opened, mask=opened.convert("RGBA").getchannel("A"))
        if box := ImageChops.difference(image, Image.new("RGB", image.size, "white")).getbbox():
            image = image.crop(box)
        image.thumbnail(THUMBNAIL)
        image.save(path, optimize=True)


def setup(app: Any) -> None:
    """Called by Sphinx."""
    app.connect("build-finished", _crop_thumbnails)
    app.connect("html-page-context", _readable)
