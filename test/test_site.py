"""The documentation builds as a site, and a broken link is an error."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from twbr_estimation.cli.main import verbs

ROOT = Path(__file__).resolve().parent.parent
pytest.importorskip("mkdocs", reason="needs the extra docs")
pytest.importorskip("mkdocstrings", reason="needs the extra docs")


def build(config: Path, target: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "-f", str(config)]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    return subprocess.run(
        [*command, "-d", str(target)], capture_output=True, text=True, cwd=ROOT, env=environment
    )


def test_the_site_builds_and_holds_every_page(tmp_path: Path) -> None:
    result = build(ROOT / "mkdocs.yml", tmp_path / "site")
    assert result.returncode == 0, result.stderr
    for page in (ROOT / "docs").rglob("*.md"):
        name = page.relative_to(ROOT / "docs").with_suffix("")
        folder = name.parent if name.name == "index" else name
        assert (tmp_path / "site" / folder / "index.html").is_file()
    arguments = (tmp_path / "site" / "cli" / "index.html").read_text()
    assert "--save-reference" in arguments and all(
        f'id="twbr-{verb}"' in arguments for verb in verbs()
    )


@pytest.mark.parametrize("link", ["missing.md", "../twbr_estimation/missing.py", "filters.md#none"])
def test_a_broken_link_is_an_error(tmp_path: Path, link: str) -> None:
    pages = tmp_path / "docs"
    pages.mkdir()
    (pages / "index.md").write_text(f"[a link]({link})\n")
    (pages / "filters.md").write_text("# Filters\n")
    config = tmp_path / "mkdocs.yml"
    config.write_text(
        f"site_name: x\nstrict: true\nhooks: [{ROOT / 'tools' / 'site_links.py'}]\n"
        "validation: {links: {anchors: warn}}\n"
    )
    assert build(config, tmp_path / "site").returncode != 0
