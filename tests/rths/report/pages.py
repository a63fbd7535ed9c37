"""Checks of every page: it loads nothing, and a browser draws, folds and prints all of it."""

from __future__ import annotations

import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

PHONES = (390, 360)
SCREENS = (1280, *PHONES)
PAPER = 703, 1009  # CSS pixels of A4 inside the margins
LEAST_TEXT = 12.0  # CSS pixels

PICTURES = """() => [...document.querySelectorAll('img, svg')].map(item => {
  const box = item.getBoundingClientRect();
  return [item.tagName === 'IMG' ? item.complete && item.naturalWidth * item.naturalHeight : 1,
          box.width, box.height];
})"""
WIDTHS = "() => [document.documentElement.scrollWidth, document.body.scrollWidth, window.innerWidth]"
SMALLEST_TEXT = """() => {
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  let least = 1000;
  while (walker.nextNode()) {
    const inside = walker.currentNode.parentElement;
    if (walker.currentNode.data.trim() && !inside.closest('svg')) {
      least = Math.min(least, parseFloat(getComputedStyle(inside).fontSize));
    }
  }
  return least;
}"""
FIGURES = """() => [...document.querySelectorAll('figure')].map(item => {
  const box = item.getBoundingClientRect();
  return [box.height, box.right, getComputedStyle(item).breakInside];
})"""
TABLES = "() => [...document.querySelectorAll('table')].map(item => item.getBoundingClientRect().right)"
HIDDEN = """() => [...document.querySelectorAll('details > :not(summary)')]
  .filter(item => !item.checkVisibility()).length"""

VOID = {"meta", "br", "img", "source", "wbr"}


class Balanced(HTMLParser):
    """Fails where a tag is left open; gathers texts, alternative texts and addresses."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.words: list[str] = []
        self.tags: set[str] = set()
        self.addresses: list[str] = []
        self.without_alt = 0
        self.feed(page)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        self.tags.add(tag)
        given = dict(attrs)
        self.addresses += [given[name] for name in ("src", "href", "srcset", "data") if name in given]
        self.without_alt += tag == "img" and not given.get("alt")
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words.append(data)

    @property
    def text(self) -> str:
        """All texts, blanks put together."""
        return " ".join("".join(self.words).split())


def check_alone(page: str) -> Balanced:
    """Check that a page loads nothing from elsewhere and is well formed; returns its parsed content."""
    found = Balanced(page)
    assert page.startswith("<!doctype html>\n<html lang=")
    assert [text for text in found.addresses if not text.startswith(("#", "data:image/png;base64,"))] == []
    assert found.without_alt == 0
    assert not found.tags & {"script", "link", "iframe", "object", "embed", "base"}
    assert not re.search(r"@import|url\(\s*['\"]?(?!#|data:)", page)
    return found


def check_in_browser(path: Path, folder: Path) -> None:
    """Open a page on screens, phones and paper; skips where there is no browser."""
    pytest.importorskip("playwright", reason="the playwright package is not installed")
    from tests import browser

    if browser.chromium() is None:
        pytest.skip("there is no Chromium on this machine")
    address = path.resolve().as_uri()
    for width in SCREENS:
        with browser.open_page(address, width) as page:
            assert page.errors == []
            assert [url for url in page.requests if not url.startswith("data:")] == [address]
            pictures = page.evaluate(PICTURES)
            assert pictures
            assert all(size > 0 for picture in pictures for size in picture), pictures
            whole, body, inner = page.evaluate(WIDTHS)
            assert max(whole, body) <= inner == width
            assert page.evaluate(SMALLEST_TEXT) >= LEAST_TEXT
    check_on_paper(address, folder)


def check_on_paper(address: str, folder: Path) -> None:
    """Check the printed page: nothing is cut off, and parts that are folded on a screen are printed."""
    from tests import browser

    width, height = PAPER
    with browser.open_page(address, width, height) as page:
        page._page.emulate_media(media="print")
        figures = page.evaluate(FIGURES)
        assert figures
        assert all(tall <= height and right <= width and kept == "avoid" for tall, right, kept in figures), (
            figures
        )
        assert all(right <= width for right in page.evaluate(TABLES))
        assert page.evaluate(HIDDEN) == 0
        printed = page.pdf(folder / "page.pdf").read_bytes()
    assert len(re.findall(rb"/Type\s*/Page\b", printed)) > 0
