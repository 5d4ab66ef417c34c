"""Texts from files, such as names and units, in each format that the package writes.

A record and a model refuse texts with control characters and with marks that change the direction of
writing. The characters that remain may still have a meaning in a format. Each function returns the text for
one format. HTML uses `html.escape`, and JSON and the quotes of CSV are escaped by their libraries.
"""

import re
import unicodedata

__all__ = ["in_c", "in_cell", "in_plot", "in_rust", "visible"]


def visible(text: str) -> str:
    r"""Return a text of one line, in which control characters and the like are escaped, for a terminal.

    The messages of errors and the names of files may contain such characters, although names and units do
    not.

    Parameters
    ----------
    text
        The text.

    Returns
    -------
    str
        The text with escape sequences of Python.

    Examples
    --------
    >>> print(visible("\x1b[2Jµm"))
    \x1b[2Jµm
    """
    kept = (unicodedata.category(c) in ("Cc", "Cf", "Cs", "Zl", "Zp") for c in text)
    return "".join(repr(c)[1:-1] if foreign else c for c, foreign in zip(text, kept, strict=True))


def in_cell(text: str) -> str:
    """Return a text for a cell of a CSV file that a spreadsheet does not take as a formula.

    Parameters
    ----------
    text
        The name of a column.

    Returns
    -------
    str
        The text; an apostrophe is put before ``=``, ``+``, ``-`` and ``@`` at its beginning.

    Examples
    --------
    >>> in_cell("=1+1"), in_cell("u")
    ("'=1+1", 'u')
    """
    return f"'{text}" if text.lstrip().startswith(("=", "+", "-", "@")) else text


def in_plot(text: str) -> str:
    r"""Return a text for a picture; dollar signs do not begin a formula.

    Parameters
    ----------
    text
        The name or the unit.

    Returns
    -------
    str
        The text with a backslash before each dollar sign, which Matplotlib does not draw.

    Examples
    --------
    >>> in_plot("US$")
    'US\\$'
    """
    return text.replace("$", r"\$")


def in_c(text: str) -> str:
    r"""Return a text for a C comment.

    A space is put between ``*`` and ``/``, which would begin or end a comment, and between question marks,
    which would begin a trigraph. A text that ends with one of these characters or with a backslash, which
    would join two lines, is followed by a space.

    Parameters
    ----------
    text
        The name or the unit.

    Returns
    -------
    str
        The text for a comment.

    Examples
    --------
    >>> in_c("m*/s"), in_c("u??/v")
    ('m* /s', 'u? ?/v')
    """
    text = re.sub(r"(?<=\*)(?=/)|(?<=/)(?=\*)|(?<=\?)(?=\?)", " ", visible(text))
    # a unit may follow a name directly, so the ends are protected too
    if text.endswith(("\\", "*", "/", "?")):
        text += " "
    return text


def in_rust(text: str) -> str:
    r"""Return a text for a Rust documentation comment.

    The documentation is Markdown, which may contain HTML: a backslash is put before the characters that begin
    a link, code, an entity or HTML.

    Parameters
    ----------
    text
        The name or the unit.

    Returns
    -------
    str
        The text for a comment.

    Examples
    --------
    >>> in_rust("<b>[x]")
    '\\<b\\>\\[x\\]'
    """
    return re.sub(r"[\\`<>&\[\]]", lambda found: "\\" + found[0], visible(text))
