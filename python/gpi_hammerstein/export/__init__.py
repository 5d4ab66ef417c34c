"""Export of models and compensators as source code and into other tools."""

from gpi_hammerstein.export.compensator import export_c, export_rust
from gpi_hammerstein.export.fmu import export_fmu
from gpi_hammerstein.export.mat import SCRIPT, export_mat
from gpi_hammerstein.export.model import export_model_c, export_model_rust
from gpi_hammerstein.export.monitor import export_monitor_c

__all__ = [
    "SCRIPT",
    "export_c",
    "export_fmu",
    "export_mat",
    "export_model_c",
    "export_model_rust",
    "export_monitor_c",
    "export_rust",
]
