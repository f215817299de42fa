"""SECURITY.md promises nothing that is not held by a test that exists."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_every_promise_names_tests_that_exist() -> None:
    promises = (ROOT / "SECURITY.md").read_text().split("## Promises")[1].split("\n## ")[0]
    bullets = re.split(r"^- ", promises, flags=re.MULTILINE)[1:]
    assert len(bullets) > 15
    files = {path.name for path in (ROOT / "tests").rglob("test_*.py")}
    functions = {
        name
        for path in (ROOT / "tests").rglob("*.py")
        for name in re.findall(r"def (test_\w+)\(", path.read_text())
    }
    for bullet in bullets:
        tests = re.findall(r"`([\w/.:]*\btest_\w+(?:\.py)?)`", bullet)
        assert tests, f"no test holds this: {bullet[:80]}"
        for named in tests:
            path, _, function = named.rpartition("::")
            if named.endswith(".py"):
                path, function = named, ""
            assert not function or function in functions, named
            assert not path or path.rpartition("/")[2] in files, named
            assert "/" not in path or (ROOT / path).is_file(), named
