"""What strangers would like a page to run: forty names and more, for tests of anyone who shows names."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from html.parser import HTMLParser

PAYLOADS = (
    "<script>top.hit=1</script>",
    "<img src=x onerror=top.hit=1>",
    "<svg onload=top.hit=1>",
    '"><script>top.hit=1</script>',
    "'><img src=x onerror='top.hit=1'>",
    "</script><script>top.hit=1</script>",
    "</title><script>top.hit=1</script>",
    "</style><script>top.hit=1</script>",
    "</textarea><svg/onload=top.hit=1>",
    "<iframe src=javascript:top.hit=1>",
    '<iframe srcdoc="<script>top.hit=1</script>">',
    "<body onload=top.hit=1>",
    "<details open ontoggle=top.hit=1>",
    "<video><source onerror=top.hit=1>",
    "<math><a xlink:href=javascript:top.hit=1>x",
    "<a href=javascript:top.hit=1>x</a>",
    "javascript:top.hit=1",
    "<object data=javascript:top.hit=1>",
    "<embed src=javascript:top.hit=1>",
    "<form action=javascript:top.hit=1><button>x",
    "<input autofocus onfocus=top.hit=1>",
    "<select autofocus onfocus=top.hit=1>",
    "<marquee onstart=top.hit=1>",
    "<link rel=stylesheet href=//evil.example/x>",
    "<meta http-equiv=refresh content=0;url=//evil.example>",
    "<base href=//evil.example/>",
    "<style>@import'//evil.example/x';</style>",
    "<img src=//evil.example/x>",
    "<template><script>top.hit=1</script></template>",
    '<noscript><p title="</noscript><svg onload=top.hit=1>">',
    "${top.hit=1}",
    "{{constructor.constructor('top.hit=1')()}}",
    "<!--><img src=x onerror=top.hit=1>-->",
    "<![CDATA[<script>top.hit=1</script>]]>",
    "&lt;script&gt;top.hit=1&lt;/script&gt;",
    "&#60;script&#62;top.hit=1&#60;/script&#62;",
    "<ScRiPt>top.hit=1</sCrIpT>",
    "<scr<script>ipt>top.hit=1</scr</script>ipt>",
    "\\u003cscript\\u003etop.hit=1\\u003c/script\\u003e",
    "<svg><animate onbegin=top.hit=1 attributeName=x>",
    "$\\href{javascript:top.hit=1}{x}$",
    "]]><svg onload=top.hit=1>",
    "__proto__",
    '=HYPERLINK("http://evil.example")',
)
"""Each fits into a name: at most 64 characters that can be printed."""

_RUNS = ("script", "iframe", "object", "embed", "base", "form", "link", "foreignobject", "animate", "marquee")
_LEADS = ("href", "src", "action", "data", "xlink:href", "srcdoc", "formaction", "poster")


class _Look(HTMLParser):
    """Everything in a page that could run or lead somewhere."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.bad: list[str] = []
        self.words: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.bad += found(tag, {key: value or "" for key, value in attrs})

    def handle_data(self, data: str) -> None:
        self.words.append(data)


def found(tag: str, attributes: dict[str, str]) -> list[str]:
    """What of an element could run or lead to somebody else."""
    bad = [f"<{tag}>"] if tag.lower() in _RUNS else []
    for key, value in attributes.items():
        leads = key.lower() in _LEADS and not value.startswith(("#", "data:image/"))
        if key.lower().startswith("on") or leads or "url(" in value.replace("url(#", ""):
            bad.append(f"<{tag} {key}={value[:40]}>")
    if tag == "meta" and attributes.get("http-equiv", "").lower() == "refresh":
        bad.append("<meta refresh>")
    return bad


def in_html(page: str) -> tuple[list[str], str]:
    """What could run in a page, and its words."""
    look = _Look()
    look.feed(page)
    look.close()
    return look.bad, "".join(look.words)


def in_svg(drawing: str) -> tuple[list[str], str]:
    """What could run in a drawing, and its words."""
    bad, words = [], []
    for element in ET.fromstring(drawing).iter():
        plain = {key.rpartition("}")[2]: value for key, value in element.attrib.items()}
        bad += found(element.tag.rpartition("}")[2], plain)
        words += [element.text or "", element.tail or ""]
    return bad, "".join(words)
