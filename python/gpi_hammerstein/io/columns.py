"""Name and unit of a column, from its header."""

import re
from dataclasses import dataclass

# Seconds in each unit of a time column.
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0}

UNITS = frozenset(
    [*TIME_UNITS, *"V mV uV kV A mA uA kA C nC pC W mW m mm um nm pm cm km N mN uN kN Nm".split()]
    + "Pa kPa MPa bar mbar psi g kg deg rad mrad urad nrad arcsec K degC degF Hz kHz MHz T mT Oe".split()
    + "Ohm kOhm F nF pF percent rpm kip kips lbf klbf kgf mil mils inch ft".split()
)
# A longer header is no name with a unit, and would take long to search.
LONGEST = 500
# Signs that stand for a letter of a unit.
SIGNS = str.maketrans({"\u00b5": "u", "\u03bc": "u", "\u03a9": "Ohm"})


# An inch is written `in`, which is also the word for an input: it is a unit only after one of these words.
LENGTHS = re.compile(r"(?i).*(displacement|position|deflection|stroke|travel|gap|length)")


@dataclass(frozen=True)
class Column:
    """A header of a column, with the name and the unit that it contains."""

    header: str
    name: str
    unit: str
    array: str
    """Name of the array that contains the column; in a table, the header itself."""

    def matches(self, wanted: str) -> bool:
        """Return whether the name `wanted` that a user gives means this column."""
        return wanted in (self.header, self.name, self.array)


def parse_header(header: str, array: str | None = None) -> Column:
    """Split a header into name and unit.

    Parameters
    ----------
    header
        The header, for example ``y_um``, ``y [um]``, ``y (um)``, ``y/um``, ``y in um`` or ``y``. Without
        brackets, the text after the last underscore, slash or space is the unit only if it is the symbol of a
        known unit, and after a space only if it has at least two letters or is V or s.
    array
        Name of the array that contains the column.

    Returns
    -------
    Column
        The name and the unit. The unit is empty if the header has none.

    Examples
    --------
    >>> parse_header("y_um").unit, parse_header("x_left").name, parse_header("Weg/mm").unit
    ('um', 'x_left', 'mm')
    """
    header = header.strip()
    name, unit = header, ""
    if len(header) > LONGEST:
        return Column(header, name, unit, array or header)
    if found := re.fullmatch(r"(.*?)[\s_]*[\[(](.*)[\])]", header):
        name, unit = found[1] or header, found[2].strip()
    else:
        name, unit = _split_unit(header)
    return Column(
        header, name, unit.translate(SIGNS) if unit.translate(SIGNS) in UNITS else unit, array or header
    )


def _split_unit(header: str) -> tuple[str, str]:
    """Split a header whose unit has no brackets."""
    *rest, last = header.split("_")
    if any(rest):
        before = "_".join(rest)
        if is_unit(last) or (last in ("in", "in/s") and LENGTHS.fullmatch(before)):
            *rest, middle = rest
            if last in TIME_UNITS and middle in UNITS and any(rest):
                return "_".join(rest), f"{middle}/{last}"
            return before, last
        if last == "in/s":
            return before, last
    if found := re.fullmatch(r"(.*\S)\s+(?:in\s+|/\s*)?(\S{2,}|V|s)", header):
        if is_unit(found[2]):
            return found[1].rstrip(" ,;:-"), found[2]
    if found := re.fullmatch(r"(.*[^\W_])/(\S+)", header):
        if is_unit(found[2]) and not is_unit(header):
            return found[1], found[2]
    return header, ""


def is_unit(text: str) -> bool:
    """Return whether a text is the symbol of a unit, or of a unit per time.

    Parameters
    ----------
    text
        The text, for example ``um`` or ``mm/s``.

    Examples
    --------
    >>> is_unit("um"), is_unit("mm/s"), is_unit("left")
    (True, True, False)
    """
    above, slash, below = text.translate(SIGNS).partition("/")
    return above in UNITS and (not slash or below in TIME_UNITS)
