"""docs/troubleshooting.md quotes messages that the programs still print."""

import ast
import re

from drone_sim.files.resources import package_path

ROOT = package_path()
QUOTED = re.compile(r"^\| (`.+?`) \| .+ \|$", re.MULTILINE)
SPAN = re.compile(r"`([^`]+)`")
PLACEHOLDER = "…"


def printed():
    """Return all texts from which messages are made: string literals of Python, shell scripts, the cockpit's page."""
    texts = [path.read_text(encoding="utf-8") for path in (ROOT / "web/src").rglob("*.js")]
    texts += [path.read_text(encoding="utf-8") for path in (ROOT / "dev.sh", *(ROOT / "packaging").glob("*.sh"))]
    for path in (ROOT / "src/drone_sim").rglob("*.py"):
        nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        texts += [node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str)]
    return "\0".join(texts)


def test_every_quoted_message_is_one_of_the_programs():
    page = (ROOT / "docs/troubleshooting.md").read_text(encoding="utf-8")
    messages = [message for cell in QUOTED.findall(page) for message in SPAN.findall(cell)]
    assert len(messages) > 40
    texts = printed()
    parts = {part.strip() for message in messages for part in message.split(PLACEHOLDER)}
    assert {part for part in parts if part not in texts} == set()
