"""Links from a device to the files of its record."""

import os
from pathlib import Path
from urllib.parse import quote

RECORDS = "records"
TARGETS = ("report.html", "explanation.json")
"""The files that a link may lead to, the best first."""


def link_to(name: str | None, folder: Path, page: Path) -> str | None:
    """Return the relative address of the report of a record, or else of its explanation.

    Parameters
    ----------
    name
        The name of the record's folder, which anybody may have written.
    folder
        The folder that contains the table and ``records``.
    page
        The page that will contain the link.

    Returns
    -------
    str or None
        An address that starts with the name of a folder or with ``..``; None if there is no file, or if the
        name is no single folder.

    Examples
    --------
    >>> link_to("../../etc", Path("fleet"), Path("fleet.html")) is None
    True
    """
    if not name or name in (".", "..") or any(c in name for c in "/\\\0"):
        return None
    for target in TARGETS:
        file = folder / RECORDS / name / target
        try:
            if file.is_file():
                relative = os.path.relpath(file, page.absolute().parent)
                return quote(Path(relative).as_posix(), errors="surrogateescape")
        except (OSError, ValueError):  # a name that is too long, or another drive
            continue
    return None
