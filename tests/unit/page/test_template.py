"""The shared template: a page runs nothing that it was not written with, its texts stay texts, and its colours can be read."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import glshade
from glshade.errors import GlshadeError
from glshade.page import template

PACKAGE = Path(glshade.__file__).parent
TEXTS = st.text(max_size=30) | st.sampled_from(["</script><script>alert(1)</script>", "\"'>", "\u2028", "a\nb", "<!--", "]]>"])


@pytest.fixture(scope="module")
def example(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A template that shows a text, in an element, an attribute and as JSON."""
    path = tmp_path_factory.mktemp("templates") / "example.html.j2"
    path.write_text(
        '{% extends "base.html.j2" %}{% block title %}{{ text }}{% endblock %}'
        '{% block body %}<p title="{{ text }}">{{ text }}</p>'
        '<script type="application/json" id="values">{{ text | tojson }}</script>{% endblock %}'
    )
    return path


class Reader(HTMLParser):
    """The elements of a page, with their attributes, and the texts in them."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.texts: dict[str, list[str]] = {}
        self.within = ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        self.within = tag

    def handle_data(self, data: str) -> None:
        self.texts.setdefault(self.within, []).append(data)


@given(text=TEXTS)
def test_texts_stay_texts(example: Path, text: str) -> None:
    page = template.render(example, text=text)
    read = Reader(page)
    # HTML has no way to write these: a parser reads them as line ends, or leaves them out.
    shown = text.replace("\r\n", "\n").replace("\r", "\n")
    assert [tag for tag, _ in read.elements].count("script") == 2
    attributes = next(attributes for tag, attributes in read.elements if tag == "p")
    assert attributes["title"] in (text, shown)
    assert json.loads("".join(read.texts["script"][:1])) == text


def test_the_policy_allows_the_pages_own_style_and_script_alone(example: Path, tmp_path: Path) -> None:
    style, script = tmp_path / "own.css", tmp_path / "own.js"
    style.write_text("p { color: red }\n")
    script.write_text("console.log(1);\n")
    page = template.render(example, [style], [script], text="")
    policy = next(a["content"] or "" for tag, a in Reader(page).elements if a.get("http-equiv") == "Content-Security-Policy")
    for tag, pattern in (("style", r"<style>(.*?)</style>"), ("script", r'<script type="module">(.*?)</script>')):
        contents = re.findall(pattern, page, re.DOTALL)
        assert len(contents) == 1
        digest = base64.b64encode(hashlib.sha256(contents[0].encode()).digest()).decode()
        assert f"{tag}-src 'sha256-{digest}';" in policy
    assert policy.startswith("default-src 'none';")
    assert "unsafe" not in policy
    assert "color: red" in page
    assert "console.log(1);" in page


@pytest.mark.parametrize("path", sorted(PACKAGE.rglob("*.html.j2")), ids=lambda path: path.parent.name)
def test_no_template_has_what_the_policy_forbids(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert not re.search(r"\sstyle=|\son[a-z]+=|<script(?! type=\"application/json\"| type=\"module\")", text)
    assert not re.search(r"\| *safe|https?://", text)


@pytest.mark.parametrize("path", [p for p in PACKAGE.rglob("*") if p.suffix in (".js", ".css") and "live" not in p.parts])
def test_no_style_or_script_ends_its_element_or_needs_a_network(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert not re.search(r"</|https?:|@import|url\(|innerHTML|fetch\(|eval\(", text)


def luminance(colour: str) -> float:
    """Returns the relative luminance of a colour such as #1b1c1e (WCAG 2.2)."""
    codes = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    r, g, b = (code / 12.92 if code <= 0.04045 else ((code + 0.055) / 1.055) ** 2.4 for code in codes)
    return 0.2126 * r + 0.7152 * g + 0.0722 * b


def palettes() -> list[dict[str, str]]:
    """Returns name -> colour for a light and for a dark screen, of the shared style."""
    text = (PACKAGE / "page" / "style.css").read_text(encoding="utf-8")
    found = [dict(re.findall(r"--(\w+): (#[0-9a-f]{6});", block)) for block in re.findall(r":root \{(.*?)\}", text, re.DOTALL)]
    assert len(found) == 2
    return found


@pytest.mark.parametrize("palette", palettes(), ids=["light", "dark"])
def test_texts_can_be_read_on_every_ground(palette: dict[str, str]) -> None:
    """WCAG 2.2, level AA: texts have a contrast of 4.5, and the outlines of the focus one of 3."""
    for ink in ("text", "quiet", "accent", "good", "warn", "bad"):
        for ground in ("ground", "panel", "raised"):
            low, high = sorted((luminance(palette[ink]), luminance(palette[ground])))
            assert (high + 0.05) / (low + 0.05) >= 4.5, (ink, ground)


def test_a_page_that_cannot_be_written_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(GlshadeError, match=r"index\.html: cannot be written: ") as error:
        template.write(tmp_path / "missing" / "index.html", "text")
    assert len(str(error.value).splitlines()) == 1


def test_a_name_that_is_no_unicode_does_not_end_the_page(tmp_path: Path, example: Path) -> None:
    values: Any = {"text": "caf\udce9"}
    template.write(tmp_path / "index.html", template.render(example, **values))
    assert "caf" in (tmp_path / "index.html").read_text(encoding="utf-8")
