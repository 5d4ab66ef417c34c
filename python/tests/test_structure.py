"""The files of the Rust crates stay short."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
# Lines of code, without comments, empty lines and tests.
LONGEST = 300
TESTS = re.compile(r"#\[cfg\(test\)\]\n(?:pub\(crate\) )?mod tests")


def lines_of_code(text: str) -> int:
    lines = TESTS.split(text)[0].splitlines()
    return sum(bool(line.strip()) and not line.strip().startswith("//") for line in lines)


@pytest.mark.parametrize("crate", ["gpi-core", "gpi-py"])
def test_no_file_is_long(crate: str) -> None:
    files = sorted((ROOT / "crates" / crate / "src").rglob("*.rs"))
    assert len(files) > 20
    lengths = {str(file.relative_to(ROOT)): lines_of_code(file.read_text(encoding="utf-8")) for file in files}
    assert {file: length for file, length in lengths.items() if length > LONGEST} == {}


def test_tests_and_comments_are_no_code() -> None:
    code = "//! A file.\n\nfn f() {} // one\n/// Two.\nfn g() {}\n"
    text = code + "\n#[cfg(test)]\nmod tests {\n    fn h() {}\n}\n"
    assert lines_of_code(text) == 2
