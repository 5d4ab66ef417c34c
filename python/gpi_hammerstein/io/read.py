"""Reading of records from files."""

from collections.abc import Sequence

from gpi_hammerstein._native import ParameterError, Record
from gpi_hammerstein.io.experiments import recording_of
from gpi_hammerstein.io.frames import Frame
from gpi_hammerstein.io.recording import Recording
from gpi_hammerstein.io.sources import Names, PathLike, read_sources


def read_record(
    path: PathLike | Frame | Sequence[PathLike | Frame],
    *,
    input: Names | None = None,
    output: Names | None = None,
    time: str | None = None,
    rate: float | None = None,
    covariate: Names | None = None,
    warmup: int | None = None,
    resample: bool | float | str | None = None,
    experiment: str | int | Sequence[int] | None = None,
) -> Record:
    """Read a record of one or several experiments.

    Parameters
    ----------
    path
        A file, or a list of files with the same columns, whose experiments are put in one record. Formats are
        CSV (``.csv``, ``.csv.gz``, also separated by semicolons, tabs or spaces), Excel (``.xlsx``), Parquet
        (``.parquet``), NumPy (``.npz``, ``.npy``), MATLAB v4, v5 or v7.3 (``.mat``), HDF5 (``.h5``), LabVIEW
        (``.lvm``, ``.tdms``) and MDF (``.mf4``). Excel, TDMS and MDF need the extras ``xlsx``, ``tdms`` and
        ``mdf``. Arrays in NumPy, MATLAB and HDF5 files have the shape (samples,), (samples, channels),
        (samples, channels, realisations) or (samples, channels, realisations, periods). Every realisation is
        an experiment; all of its periods except the last one are warm-up. A Polars or pandas data frame or an
        xarray dataset, with columns named as in a CSV file, is also accepted.
    input, output, covariate
        Names of the columns with or without their unit: ``"u_V"`` or ``"u"``. If they are not given, columns
        are recognised by words in their names and by their units, and a note says why. Inputs: ``u``, ``u1``,
        ``input``, else words such as ``voltage``, ``drive``, ``command``. Outputs: ``y``, ``y1``, ``output``,
        else words such as ``position``, ``sensor``. Every other column with only numbers is a covariate
        (``covariate=[]`` ignores them). A ``.npy`` file contains only the input; `output` is then the path of
        the file with the output. For several ``.npy`` files, give one output file for each of them.
    time
        Name of the time column; ``t``, ``time`` and similar names are recognised. The unit is part of the
        name (``t_ms``, ``Time (ms)``); without a unit, it is s. Dates and times of day are converted to
        seconds.
    rate
        Sampling rate in Hz; it replaces the time column.
    warmup
        Number of samples at the start of every experiment that drive the model but are not scored. None takes
        0, or the number that follows from the periods of an array.
    resample
        A rate in Hz, or True (or ``"auto"``) for the rate of the median step. Makes non-uniform sampling
        uniform by linear interpolation, and cuts the record into several experiments at gaps and where the
        clock jumps back. Rows in which a used column has no number are left out.
    experiment
        Experiments to keep, numbered from 0: ``3``, ``[0, 2]``, ``"0-4,7"``.

    Returns
    -------
    Record
        u, y, covariates, rate, names and units.

    Raises
    ------
    ParameterError
        An option contradicts the file or is out of range.
    DataError
        The file is missing, is not a regular file, is corrupt, is empty, or contains text, NaN or infinite
        samples; columns are missing or have different lengths; time stamps have gaps, run backwards or are
        not uniform. The message states the column and the rows, which are counted from 0. The file contains
        more than a limit allows.

    Notes
    -----
    Four limits protect against files that exhaust memory or time. They are environment variables:
    ``GPI_MAX_READ_BYTES`` (1073741824), the size of the data of one file after decompression;
    ``GPI_MAX_READ_RATIO`` (100), the ratio of this size to the size of the file, if the data has more than 16
    MiB; ``GPI_MAX_READ_COLUMNS`` (1000), the number of columns or variables of one file;
    ``GPI_MAX_READ_SECONDS`` (120), the time for a Parquet, HDF5, Excel, TDMS or MDF file. These formats are
    read in another process, because their libraries can end a process or block it if a file is corrupt. An
    HDF5 file that refers to other files is refused.

    Examples
    --------
    >>> record = gpi.read_record("run.csv", input="u_V", output="y_um")  # doctest: +SKIP
    >>> record.rate, record.output_units  # doctest: +SKIP
    (200.0, ['um'])
    """
    recording = read_recording(
        path,
        input=input,
        output=output,
        time=time,
        rate=rate,
        covariate=covariate,
        warmup=warmup,
        resample=resample,
        experiment=experiment,
    )
    return recording.record()


def read_recording(
    path: PathLike | Frame | Sequence[PathLike | Frame],
    *,
    input: Names | None = None,
    output: Names | None = None,
    time: str | None = None,
    rate: float | None = None,
    covariate: Names | None = None,
    warmup: int | None = None,
    resample: bool | float | str | None = None,
    experiment: str | int | Sequence[int] | None = None,
) -> Recording:
    """Read like :func:`read_record`, but do not require an output column.

    Parameters
    ----------
    path, input, output, time, rate, covariate, warmup, resample, experiment
        As in :func:`read_record`.

    Returns
    -------
    Recording
        The experiments, and notes on changes of the samples.

    Raises
    ------
    ParameterError, DataError
        As in :func:`read_record`.

    Examples
    --------
    >>> read_recording("input_only.csv").runs[0].u.shape  # doctest: +SKIP
    (1000, 1)
    """
    if rate is not None and not rate > 0:
        raise ParameterError(f"`rate` = {rate}: the sampling rate in Hz must be positive")
    if rate is not None and resample:
        raise ParameterError(
            "`rate` and `resample` exclude each other, because resampling needs the time stamps"
        )
    if warmup is not None and warmup < 0:
        raise ParameterError(f"`warmup` = {warmup}: must be a number of samples, zero or larger")
    found = read_sources(path, output)
    return recording_of(
        found,
        input=input,
        time=time,
        rate=rate,
        covariate=covariate,
        warmup=warmup,
        resample=resample,
    ).select(experiment)
