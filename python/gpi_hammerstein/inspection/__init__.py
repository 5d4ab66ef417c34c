"""What a record file contains, what a model of it can and cannot determine, and which command to run next."""

from gpi_hammerstein.inspection.inspection import inspect
from gpi_hammerstein.inspection.result import Inspection

__all__ = ["Inspection", "inspect"]
