"""Records from CSV, Parquet, NumPy and MATLAB files."""

from gpi_hammerstein.io.read import read_record, read_recording
from gpi_hammerstein.io.recording import Recording, Run, raise_warmup

__all__ = ["Recording", "Run", "raise_warmup", "read_record", "read_recording"]
