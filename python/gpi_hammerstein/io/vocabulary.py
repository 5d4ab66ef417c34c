"""How strongly the name and the unit of a column speak for a role.

The score of a column for a role is the weight of the strongest word in its name, plus one if its unit fits::

    score = max(weight of a word in the name, or 0) + (1 if the unit fits the role)

==========  ==============================================================  ==================================
weight      words for the input                                             words for the output
==========  ==============================================================  ==================================
10          the whole name is ``u``, ``u1``, ``in``, ``input``              ``y``, ``y1``, ``out``, ``output``
4           what commands: command, drive, generator, an analog output      what measures: sensor, encoder, ..
3           what drives: voltage, current, pressure, motor                  what moves: position, angle, force
2           what is wanted: reference, setpoint, desired
==========  ==============================================================  ==================================

A word of the table is found in a name if it equals one of the name's words, if it has four letters or more
and one of them begins with it, or if it has six letters or more and one of them contains it (German joins
words: "Stellspannung"). Words are compared without case and accents. Units of voltage, current and pressure
fit the input, units of length and angle the output. A column whose name contains a word for something else
(velocity, temperature, trigger) has the score zero.
"""

import re
import unicodedata
from functools import lru_cache

from gpi_hammerstein.io.columns import TIME_UNITS, Column

EXACT = {
    "time": re.compile(r"t|time|timestamp", re.IGNORECASE),
    "input": re.compile(r"(u|in|input)_?\d*", re.IGNORECASE),
    "output": re.compile(r"(y|out|output)_?\d*", re.IGNORECASE),
}
EXACTLY = 10
"""The score of a column whose whole name is the usual one."""

_WORDS: dict[str, list[tuple[int, str]]] = {
    "time": [(4, "t time zeit zeitstempel timestamp temps tiempo tempo elapsed sekunden seconds xvalue")],
    "input": [
        (
            4,
            "u in input eingang command cmd drive driver stell ansteuer generator waveform excitation "
            "anregung ao dac",
        ),
        (
            3,
            "voltage volt spannung tension current strom pressure druck motor actuator aktor aktuator "
            "amplifier",
        ),
        (2, "reference ref setpoint desired target demand soll wanted"),
    ],
    "output": [
        (
            4,
            "y out output ausgang sensor cap capacitive kapazitiv lvdt encoder interferometer laser "
            "probe gauge",
        ),
        (4, "measured measurement mess gemessen ist response antwort ai adc readback"),
        (3, "position pos displacement disp deflection weg auslenkung hub stroke travel strain dehnung"),
        (3, "angle winkel force kraft"),
    ],
}
OTHER = (
    "velocity speed geschwindigkeit acceleration beschleunigung temperature temperatur temp humidity error "
    "trigger comment kommentar label status index"
)
# A longer name is no name, and would take long to search.
LONGEST = 200
UNITS_OF = {
    "time": frozenset(TIME_UNITS),
    "input": frozenset("V mV uV kV A mA uA kA Pa kPa MPa bar mbar psi".split()),
    "output": frozenset("m mm um nm pm cm in inch mil mils deg rad mrad urad nrad arcsec".split()),
}
# Letters that German replaces by two.
LETTERS = str.maketrans({"\u00e4": "ae", "\u00f6": "oe", "\u00fc": "ue", "\u00df": "ss"})


def score(column: Column, role: str) -> tuple[int, str]:
    """Return how strongly a column speaks for a role, and why.

    Parameters
    ----------
    column
        The column.
    role
        ``time``, ``input`` or ``output``.

    Returns
    -------
    int
        The score; 0 if nothing speaks for the role.
    str
        The reason, in words.

    Examples
    --------
    >>> from gpi_hammerstein.io.columns import parse_header
    >>> score(parse_header("Capacitive sensor [nm]"), "output")
    (5, 'its name contains `capacitive` and its unit is nm')
    """
    if EXACT[role].fullmatch(column.name):
        return EXACTLY, f"it is named `{column.name}`"
    words = words_of(column.name)
    if _OTHER.search(words):
        return 0, ""
    points, reasons = 0, []
    for weight, pattern in _PATTERNS[role]:
        if weight > points and (found := pattern.search(words)):
            points, reasons = weight, [f"its name contains `{found[0]}`"]
    if column.unit in UNITS_OF[role]:
        points += 1
        reasons.append(f"its unit is {column.unit}")
    return points, " and ".join(reasons)


@lru_cache(maxsize=1 << 15)
def words_of(name: str) -> str:
    """Return the words of a name, separated by spaces, in lower case and without accents and digits.

    Parameters
    ----------
    name
        The name; words are separated by other characters, or by a capital after a small letter.

    Examples
    --------
    >>> words_of("Dev1/ai0"), words_of("stageVoltage")
    ('dev ai', 'stage voltage')
    """
    parts = re.sub(r"([^\W\d_A-Z])([A-Z])", r"\1 \2", name[:LONGEST].replace("X_Value", "xvalue"))
    plain = unicodedata.normalize("NFKD", parts.lower().translate(LETTERS))
    return " ".join(re.findall(r"[a-z]+", "".join(c for c in plain if not unicodedata.combining(c))))


def pattern(words: str) -> re.Pattern[str]:
    """Return the pattern that finds one of these words in the words of a name.

    Parameters
    ----------
    words
        Words that are separated by spaces.

    Examples
    --------
    >>> [bool(pattern("spannung ai").search(name)) for name in ("stellspannung", "ai", "fail")]
    [True, True, False]
    """
    options = []
    for word in words.split():
        before, after = r"\w*" if len(word) >= 6 else "", r"\w*" if len(word) >= 4 else ""
        options.append(before + word + after)
    return re.compile(rf"\b(?:{'|'.join(options)})\b")


_PATTERNS = {role: [(weight, pattern(words)) for weight, words in rows] for role, rows in _WORDS.items()}
_OTHER = pattern(OTHER)
