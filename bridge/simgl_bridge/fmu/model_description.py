"""``modelDescription.xml`` and ``buildDescription.xml`` of an FMU (FMI 3.0.2, 2.4 and 2.5)."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from xml.etree import ElementTree as ET

from simgl import __version__
from simgl_bridge.fmu.variables import IMAGE_STATES, CameraModel, Variable

# Of units: exponents of SI base units.
UNITS: dict[str, dict[str, str]] = {
    "1": {},
    "m": {"m": "1"},
    "m/s": {"m": "1", "s": "-1"},
    "rad": {"rad": "1"},
    "rad/s": {"rad": "1", "s": "-1"},
    "s": {"s": "1"},
    "DN/e-": {},
}
LOG_CATEGORIES = {
    "logStatusError": "why a call failed",
    "server": "which server is used, and how far it is while it starts",
}
# A step of 10 Hz.
_STEP_S, _STOP_S = 0.1, 10.0


def model_description(
    model: CameraModel, variables: Sequence[Variable], identifier: str, token: str
) -> bytes:
    """The model description as UTF-8.

    identifier : of the model: the name of its shared library
    token : of the instantiation, which the C code compares
    """
    camera = model.scenario.cameras[model.camera]
    root = ET.Element(
        "fmiModelDescription",
        fmiVersion="3.0",
        modelName=f"{model.scenario.name}.{model.camera}",
        instantiationToken=token,
        description=f"camera {model.camera} of the scenario {model.scenario.name}: "
        f"{camera.detector.width} x {camera.detector.height} pixels",
        generationTool=f"simgl {__version__}",
        variableNamingConvention="structured",
    )
    ET.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=identifier,
        needsExecutionTool="true",
        canBeInstantiatedOnlyOncePerProcess="false",
        canGetAndSetFMUState="false",
        canSerializeFMUState="false",
        canHandleVariableCommunicationStepSize="true",
    )
    units = ET.SubElement(root, "UnitDefinitions")
    for name, exponents in UNITS.items():
        ET.SubElement(ET.SubElement(units, "Unit", name=name), "BaseUnit", exponents)
    types = ET.SubElement(root, "TypeDefinitions")
    states = ET.SubElement(types, "EnumerationType", name="ImageStatus")
    for name, value, description in IMAGE_STATES:
        ET.SubElement(states, "Item", name=name, value=str(value), description=description)
    categories = ET.SubElement(root, "LogCategories")
    for name, description in LOG_CATEGORIES.items():
        ET.SubElement(categories, "Category", name=name, description=description)
    ET.SubElement(
        root, "DefaultExperiment", startTime="0", stopTime=f"{_STOP_S:g}", stepSize=f"{_STEP_S:g}"
    )
    described = ET.SubElement(root, "ModelVariables")
    for reference, variable in enumerate(variables):
        _describe(described, variable, reference)
    structure = ET.SubElement(root, "ModelStructure")
    outputs = [str(i) for i, v in enumerate(variables) if v.causality == "output"]
    for kind in ("Output", "InitialUnknown"):
        for reference_text in outputs:
            ET.SubElement(structure, kind, valueReference=reference_text)
    return _text(root)


def build_description(
    identifier: str, c_files: Sequence[str], cpp_files: Sequence[str], platform: str | None
) -> bytes:
    """How the sources are compiled, as UTF-8; ``platform`` names the one of the binary."""
    root = ET.Element("fmiBuildDescription", fmiVersion="3.0")
    build = ET.SubElement(root, "BuildConfiguration", modelIdentifier=identifier)
    if platform is not None:
        build.set("platform", platform)
    for language, files in (("C99", c_files), ("C++17", cpp_files)):
        sources = ET.SubElement(build, "SourceFileSet", language=language)
        for name in files:
            ET.SubElement(sources, "SourceFile", name=name)
    ET.SubElement(
        build,
        "Library",
        name="zmq",
        version=">=4.3",
        external="true",
        description="ZeroMQ with CURVE or without",
    )
    return _text(root)


def _describe(parent: ET.Element, variable: Variable, reference: int) -> None:
    element = ET.SubElement(
        parent,
        variable.type,
        name=variable.name,
        valueReference=str(reference),
        causality=variable.causality,
        description=variable.description,
    )
    if variable.causality == "parameter":
        element.set("variability", "fixed")
    elif variable.causality in ("input", "output"):
        element.set("variability", "continuous" if variable.continuous else "discrete")
    if variable.type == "Enumeration":
        element.set("declaredType", "ImageStatus")
    if variable.type == "Binary":
        element.set("mimeType", "application/octet-stream")
    if variable.unit is not None:
        element.set("unit", variable.unit)
    for key, limit in (("min", variable.smallest), ("max", variable.largest)):
        if isfinite(limit):
            element.set(key, repr(limit))
    for length in variable.shape:
        ET.SubElement(element, "Dimension", start=str(length))
    if variable.start is not None and variable.type == "String":
        for text in variable.start:
            ET.SubElement(element, "Start", value=str(text))
    elif variable.start is not None:
        numbers = (_boolean(v) if variable.type == "Boolean" else repr(v) for v in variable.start)
        element.set("start", " ".join(numbers))


def _boolean(value: object) -> str:
    return "true" if value else "false"


def _text(root: ET.Element) -> bytes:
    ET.indent(root)
    return ET.tostring(root, encoding="UTF-8", xml_declaration=True) + b"\n"
