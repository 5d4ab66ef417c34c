"""Export as a functional mock-up unit (FMU) of FMI 3.0."""

import io
import os
import tempfile
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Literal
from xml.etree import ElementTree

from gpi_hammerstein._native import Model, ParameterError, __version__
from gpi_hammerstein.export.chain import Channel, chain_of
from gpi_hammerstein.export.compensator import sources_in_c
from gpi_hammerstein.export.compiled import compiler, platform_tuple, shared_library
from gpi_hammerstein.export.language_c import model_in_c
from gpi_hammerstein.export.templates import digest, filled
from gpi_hammerstein.files import require_file, write_atomically

What = Literal["model", "compensator"]


@dataclass(frozen=True)
class Unit:
    """What an FMU consists of."""

    #: The prefix of its functions in C, and its identifier.
    name: str
    description: str
    token: str
    rate: float
    inputs: list[Channel]
    outputs: list[Channel]
    sources: dict[str, str]

    @property
    def variables(self) -> list[tuple[str, str, str]]:
        """Names, units and causalities; the place is the value reference."""
        channels = [("input", own) for own in self.inputs] + [("output", own) for own in self.outputs]
        variables, taken = [("time", "", "independent")], {"time"}
        for causality, own in channels:
            # an input and an output may have the same name
            name, count = own.name, 1
            while name in taken:
                count += 1
                name = f"{own.name} ({causality})" if count == 2 else f"{own.name} ({causality} {count})"
            taken.add(name)
            variables.append((name, own.unit, causality))
        return variables


def export_fmu(
    model: Model,
    file: str | os.PathLike[str],
    *,
    what: What = "model",
    limits: tuple[float, float] | None = None,
) -> None:
    """Write an FMU for co-simulation with FMI 3.0, of a model with its effects or of its compensator.

    The FMU contains a library for this platform, which the system's C compiler makes, and its source code in
    C99 with a description of how to compile it for others. The variable CC names another compiler.

    The variables are the inputs and outputs of the model by their names, and the covariates that an effect
    reads. At the end of the initialization, the model is in steady state at the inputs that are set then, as
    the first sample of :meth:`Model.simulate`. A step from :math:`t` computes the sample with the inputs that
    were set at :math:`t`: after k + 1 steps of :math:`1 / rate`, the output is that of sample k. A step of n
    sampling intervals computes n samples with the same inputs. Other steps are an error.

    Parameters
    ----------
    model
        The model. Only a model of one input and one output has a compensator.
    file
        The file, for example ``model.fmu``.
    what
        ``"model"``: from the input to the output; ``"compensator"``: from the reference to the drive.
    limits
        Lowest and highest drive of a compensator, in the input's unit.

    Raises
    ------
    ParameterError
        There is no C compiler, an effect cannot be exported, limits for a model, or the file cannot be
        written.
    DataError
        A compensator of a model of several inputs or outputs.

    References
    ----------
    Modelica Association, Functional Mock-up Interface Specification, version 3.0.2, 2024,
    https://fmi-standard.org/docs/3.0.2/.

    Examples
    --------
    >>> gpi.export_fmu(model, "model.fmu")  # doctest: +SKIP
    >>> gpi.export_fmu(model, "compensator.fmu", what="compensator", limits=(0.0, 10.0))  # doctest: +SKIP
    """
    if what not in ("model", "compensator"):
        raise ParameterError(f"`what` = {what}: must be model or compensator")
    if what == "model" and limits is not None:
        raise ParameterError(f"`limits` = {limits}: only a compensator has limits; leave them out")
    require_file(file, "file")
    compiler()
    unit = _model(model) if what == "model" else _compensator(model, limits)
    write_atomically(file, packed(unit, Path(file).stem))


def _model(model: Model) -> Unit:
    chain = chain_of(model)
    name = "gpi_model"
    numbers = (len(chain.inputs) + len(chain.covariates), len(chain.outputs))
    used = {"leak"} if chain.covariates else {"plain"}
    held = "its last finite value was used"
    sources = model_in_c(model, "double", name)
    sources |= _interface(name, digest(model), model.rate, numbers, used, "now->inputs", held)
    inputs, outputs = chain.inputs + chain.covariates, chain.outputs
    said = ", ".join(str(effect["name"]) for effect in model.effects) or "none"
    description = f"Simulates a model of hysteresis and linear dynamics; effects: {said}"
    return Unit(name, description, digest(model), model.rate, inputs, outputs, sources)


def _compensator(model: Model, limits: tuple[float, float] | None) -> Unit:
    name = "gpi_compensator"
    found = model.compensator(limits=limits)
    token = f"{digest(model)}-compensator"
    sources = sources_in_c(model, found, "double", name)
    held = "the drive was held"
    sources |= _interface(name, token, model.rate, (1, 1), {"compensator"}, "now->inputs[0]", held)
    # the reference is an output of the model, and the drive its input
    inputs = [Channel(f"{model.output_names[0]}_reference", model.output_units[0])]
    outputs = [Channel(model.input_names[0], model.input_units[0])]
    description = f"Computes the drive for a reference; compensated: {', '.join(found.compensated)}"
    return Unit(name, description, token, model.rate, inputs, outputs, sources)


def _interface(
    name: str, token: str, rate: float, numbers: tuple[int, int], used: set[str], start: str, held: str
) -> dict[str, str]:
    values = {"name": name, "NAME": name.upper(), "token": token, "rate": repr(float(rate))}
    values |= {"inputs": str(numbers[0]), "outputs": str(numbers[1]), "start_inputs": start, "held": held}
    values["absent"] = filled("fmi3_absent.c", values, used)
    return {"fmi3.c": filled("fmi3.c", values, used)}


def packed(unit: Unit, title: str) -> bytes:
    """Return the archive: the description, the sources, how to compile them, and the library."""
    names, ending = platform_tuple()
    with tempfile.TemporaryDirectory(prefix="gpi-fmu-") as place:
        folder = Path(place)
        for file, text in unit.sources.items():
            (folder / file).write_text(text, encoding="utf-8")
        library = folder / f"{unit.name}{ending}"
        shared_library([folder / file for file in unit.sources if file.endswith(".c")], library)
        content = library.read_bytes()
    files: dict[str, bytes] = {"modelDescription.xml": described(unit, title)}
    files |= {f"sources/{file}": text.encode() for file, text in unit.sources.items()}
    files["sources/buildDescription.xml"] = build_description(unit)
    files[f"binaries/{names}/{unit.name}{ending}"] = content
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as zipped:
        for file, data in files.items():
            # with the date of ZipInfo, the same model gives the same file
            entry = zipfile.ZipInfo(file)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            zipped.writestr(entry, data)
    return archive.getvalue()


def described(unit: Unit, title: str) -> bytes:
    """Return modelDescription.xml."""
    root = ElementTree.Element(
        "fmiModelDescription",
        fmiVersion="3.0",
        modelName=title,
        instantiationToken=unit.token,
        description=unit.description,
        generationTool=f"gpi-hammerstein {__version__}",
        variableNamingConvention="flat",
    )
    ElementTree.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=unit.name,
        canGetAndSetFMUState="true",
        canSerializeFMUState="true",
        fixedInternalStepSize=repr(1.0 / unit.rate),
    )
    units = sorted({own for _, own, _ in unit.variables if own})
    if units:
        definitions = ElementTree.SubElement(root, "UnitDefinitions")
        for own in units:
            ElementTree.SubElement(definitions, "Unit", name=own)
    ElementTree.SubElement(root, "DefaultExperiment", stepSize=repr(1.0 / unit.rate))
    variables = ElementTree.SubElement(root, "ModelVariables")
    structure = ElementTree.SubElement(root, "ModelStructure")
    references = []
    for reference, (name, own, causality) in enumerate(unit.variables):
        attributes = {"name": name, "valueReference": str(reference), "causality": causality}
        attributes |= {"variability": "continuous"}
        attributes |= {"unit": own} if own else {}
        attributes |= {"start": "0"} if causality == "input" else {}
        ElementTree.SubElement(variables, "Float64", attributes)
        references += [str(reference)] if causality == "output" else []
    for kind in ("Output", "InitialUnknown"):
        for number in references:
            ElementTree.SubElement(structure, kind, valueReference=number)
    return _written(root)


def build_description(unit: Unit) -> bytes:
    """Return buildDescription.xml."""
    root = ElementTree.Element("fmiBuildDescription", fmiVersion="3.0")
    build = ElementTree.SubElement(root, "BuildConfiguration", modelIdentifier=unit.name)
    files = ElementTree.SubElement(build, "SourceFileSet", language="C99")
    for file in unit.sources:
        if file.endswith(".c"):
            ElementTree.SubElement(files, "SourceFile", name=file)
    return _written(root)


def _written(root: ElementTree.Element) -> bytes:
    ElementTree.indent(root)
    text: bytes = ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)
    return text + b"\n"
