"""Hook of mkdocs: links from a page to a file of the checkout become the file's name as code.

The pages are read in the checkout, too, where a link to a source file is of use; a site has no
such file. A link to a file that does not exist is an error of the build.
"""

from __future__ import annotations

import logging
import re
from pathlib import Path, PurePosixPath
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
LINK = re.compile(r"\[([^\]]+)\]\(((?:\.\./)+[^)#\s]+)(#[^)\s]*)?\)")
log = logging.getLogger("mkdocs.hooks.site_links")


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Return the page with links that leave the folder of the documents as plain text."""
    folder = PurePosixPath("docs") / PurePosixPath(page.file.src_uri).parent

    def plain(match: re.Match[str]) -> str:
        text, target, _ = match.groups()
        path = (ROOT / folder / target).resolve()
        if path.is_relative_to(ROOT / "docs"):
            return match.group(0)
        if not path.exists():
            log.warning("%s links to %s, which does not exist", page.file.src_uri, target)
        return f"`{path.relative_to(ROOT)}`" if "/" in text or "." in text else text

    return LINK.sub(plain, markdown)
