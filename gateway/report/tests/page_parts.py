"""A page as a browser would take it apart, without one."""

from __future__ import annotations

import json
from base64 import b64decode
from collections.abc import Sequence
from gzip import decompress
from html.parser import HTMLParser
from typing import Any

# attributes that make a browser load something
LOADS = {"src", "srcset", "href", "action", "formaction", "poster", "data", "background", "ping", "manifest"}


class PageParts(HTMLParser):
    """What of a page matters here."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.ids: list[str] = []
        self.styles: list[str] = []
        self.texts: list[str] = []
        self._inside: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: Sequence[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag != "meta":
            self._inside.append(tag)
        self.ids += [value for name, value in attrs if name == "id" and value]

    def handle_endtag(self, tag: str) -> None:
        while self._inside and self._inside.pop() != tag:
            pass

    def handle_data(self, data: str) -> None:
        if "style" in self._inside:
            self.styles.append(data)
        elif "script" not in self._inside:
            self.texts.append(data)

    @property
    def words(self) -> str:
        """All that is read without a script, with single spaces."""
        return " ".join(" ".join(self.texts).split())

    def drawings(self) -> list[list[dict[str, Any]]]:
        """As plotly.js gets them, by the elements that hold them."""
        found = (one["data-drawings"] for _, one in self.tags if "data-drawings" in one)
        return [json.loads(decompress(b64decode(letters or ""))) for letters in found]
