"""Write the JSON Schemas of all files and of what `--json` prints to docs/reference/schemas.

Run it from the root of the project: `python tools/write_schemas.py`.
"""

import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import schema_results as results  # noqa: E402
import schema_signals as signals  # noqa: E402
from schema_comparisons import COMPARISON  # noqa: E402
from schema_model import MODEL  # noqa: E402
from schema_monitor import MONITOR  # noqa: E402
from schema_parts import Schema, all_of_file  # noqa: E402

FOLDER = Path(__file__).resolve().parents[1] / "docs" / "reference" / "schemas"
#: Titles and schemas by the member `schema` of the object. The list of public records has no such member.
SCHEMAS: dict[str, tuple[str, Schema]] = {
    "gpi-model/1": ("A model", MODEL),
    "gpi-identification/1": ("The result of `gpi identify`", results.IDENTIFICATION),
    "gpi-explanation/1": ("The result of `gpi explain`", results.EXPLANATION),
    "gpi-validation/1": ("The result of `gpi validate`", results.VALIDATION),
    "gpi-simulation/1": ("The result of `gpi simulate`", results.SIMULATION),
    "gpi-compensation/1": ("The result of `gpi compensate`", signals.COMPENSATION),
    "gpi-inspection/1": ("The result of `gpi inspect`", signals.INSPECTION),
    "gpi-excitation/1": ("The result of `gpi excite`", signals.EXCITATION),
    "gpi-batch/1": ("The result of `gpi batch`", signals.BATCH),
    "gpi-comparison/1": ("The result of `gpi compare`", COMPARISON),
    "gpi-monitor/1": ("The result of `gpi monitor`", MONITOR),
    "gpi-demo/1": ("The result of `gpi demo`", results.DEMO),
    "gpi-reproduction/1": ("The result of `gpi reproduce`", results.REPRODUCTION),
    "gpi-datasets": ("The result of `gpi datasets list`", signals.DATASETS),
}


def file_of(name: str) -> Path:
    """Return the file of a schema."""
    return FOLDER / f"{name.replace('/', '-')}.json"


def written(name: str) -> str:
    """Return the text of a schema."""
    title, schema = SCHEMAS[name]
    return json.dumps(all_of_file(title, name, schema), indent=2, ensure_ascii=False) + "\n"


def main() -> None:
    """Write all schemas."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name in SCHEMAS:
        file_of(name).write_text(written(name), encoding="utf-8")
    print(f"{len(SCHEMAS)} schemas in {FOLDER}")


if __name__ == "__main__":
    main()
