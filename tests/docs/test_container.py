"""Container and recipes install what ./run installs. No image is built here."""

from __future__ import annotations

import re
from pathlib import Path

import yaml

from tools.page_blocks import blocks

ROOT = Path(__file__).parents[2]
DOCKERFILE = (ROOT / "Dockerfile").read_text()


def libraries() -> set[str]:
    """Debian packages besides Python that ./run asks for."""
    run = (ROOT / "run").read_text()
    asked = run[run.index("missing_packages()") : run.index("has_library()")]
    return set(re.findall(r'\|\| echo "([\w-]+)"', asked))


def installed(text: str) -> set[str]:
    (names,) = re.findall(r"apt-get install -y --no-install-recommends ([\w -]+)", text)
    return set(names.split())


def test_the_container_has_the_packages_of_run() -> None:
    assert {"libegl1", "libgl1"} < libraries()
    assert installed(DOCKERFILE) == libraries()


def test_the_container_copies_files_that_exist() -> None:
    for name in re.findall(r"^COPY (?!--from)(\S+)", DOCKERFILE, re.M):
        assert (ROOT / name).exists()


def test_the_pages_install_the_same_packages() -> None:
    page = (ROOT / "docs" / "install.md").read_text()
    assert installed(page) == libraries() | {"python3", "python3-venv"}


def test_the_recipe_for_continuous_integration_is_read() -> None:
    page = ROOT / "docs" / "howto" / "container.md"
    (text,) = (block.text for block in blocks(page) if block.language == "yaml")
    (job,) = yaml.safe_load(text)["jobs"].values()
    commands = " ".join(step.get("run", "") for step in job["steps"])
    # The runner brings certificates and Python.
    assert installed(commands.split(" pip ")[0]) == libraries() - {"ca-certificates"}
    assert job["env"]["LP_NUM_THREADS"] == "0"
