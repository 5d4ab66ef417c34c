"""Writing of files and of folders of results as transactions, and model files.

A file or a folder of results appears whole or not at all, also if the process is killed at any moment:

- New content is written under a temporary name that nobody can predict (:mod:`.temporary`), and then takes
  the place of the old content in one step of the file system (:mod:`.single` for a file, :mod:`.folder` and
  :mod:`.exchange` for a folder).
- What a killed process left behind is removed by the next one that writes to the same folder.
- Targets that cannot be written are refused before the work begins (:mod:`.require`).
"""

from gpi_hammerstein.files.folder import staged
from gpi_hammerstein.files.models import load_model, save_model
from gpi_hammerstein.files.require import require_file, require_folder
from gpi_hammerstein.files.single import write_atomically

__all__ = ["load_model", "require_file", "require_folder", "save_model", "staged", "write_atomically"]
