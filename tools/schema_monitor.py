"""The JSON Schema of what `gpi monitor` says of a machine."""

from schema_parts import Schema, closed, flag, listed, maybe, number, one_of, size, text

TESTED = ("offset", "gain", "resonance", "hysteresis-width", "noise", "line")
CHANGE = closed(
    {
        "what": one_of(*TESTED),
        "channel": text("the output, or the input whose hysteresis has changed"),
        "size": number("the change; of a line, its amplitude"),
        "unit": text("that of the output, Hz or %"),
        "std": maybe(size("standard deviation of the size by the noise; null if it is not known")),
        "since_s": size("seconds of data before the change"),
        "confidence": size("probability that this has changed, and nothing else in its place"),
        "instead": listed(one_of(*TESTED), "what may have changed in its place"),
        "frequency_hz": maybe(size("of the resonance before the change, or of the line; null elsewhere")),
    },
    said="One change.",
)
MONITOR: Schema = closed(
    {
        "schema": {"const": "gpi-monitor/1"},
        "model": text("the file"),
        "records": listed(text(), "files and folders; `-` is standard input"),
        "seconds": size("of data"),
        "false_alarms_per_hour": size("at most"),
        "tested": listed(one_of(*TESTED)),
        "changed": flag("whether a change was noticed"),
        "changes": listed(CHANGE),
        "next": maybe(closed({"why": text(), "command": text()})),
    }
)
