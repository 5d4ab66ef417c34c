"""The public API: signatures from stub and sources, docstrings cut into numpydoc sections."""

import ast
import inspect
import re
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import gpi_hammerstein as gpi
from gpi_hammerstein import _native, datasets, estimator, interop, plot

Definition = ast.ClassDef | ast.FunctionDef

STUB: dict[str, Definition] = {
    node.name: node
    for node in ast.parse(Path(_native.__file__).with_name("_native.pyi").read_text()).body
    if isinstance(node, Definition)
}


@dataclass(frozen=True)
class Item:
    """A name of the API: what its signature says and what its docstring says."""

    name: str
    kind: str  # function, class, exception, method, property or call
    parameters: dict[str, str]  # annotations by name
    returns: str
    doc: str

    @property
    def sections(self) -> dict[str, str]:
        """Text by heading; the summary has an empty one."""
        parts = re.split(r"^([A-Z][a-z]+(?: [A-Z][a-z]+)?)\n-+$\n?", self.doc, flags=re.MULTILINE)
        return {"": parts[0]} | dict(zip(parts[1::2], parts[2::2], strict=True))

    @property
    def entries(self) -> dict[str, tuple[str, str]]:
        """Head and description of every documented parameter."""
        return {
            name.strip(): (head, text)
            for head, text in entries(self.sections.get("Parameters", ""))
            for name in head.split(" : ")[0].split(",")
        }

    def texts(self) -> Iterator[tuple[str, str, str]]:
        """What can be a quantity: its name, its annotation, what is said of it."""
        for name, annotation in self.parameters.items():
            said = self.doc if self.kind == "call" else " ".join(self.entries.get(name, ()))
            yield name, annotation, said
        if self.kind in ("property", "call"):
            yield "the value", self.returns, self.doc
        elif self.returns:
            yield "the return value", self.returns, self.sections.get("Returns", "")


def entries(section: str) -> list[tuple[str, str]]:
    """Heads at the margin, each with the indented text below it."""
    heads = re.split(r"^(?=\S)", section, flags=re.MULTILINE)
    pairs = (entry.partition("\n") for entry in heads if entry.strip())
    return [(head.strip(), textwrap.dedent(text).strip()) for head, _, text in pairs]


def public() -> Iterator[tuple[str, Any]]:
    """Every exported function and class by the name that users write."""
    modules: list[tuple[str, ModuleType]] = [
        ("", gpi),
        ("plot.", plot),
        ("interop.", interop),
        ("datasets.", datasets),
        ("estimator.", estimator),
    ]
    for prefix, module in modules:
        for name in sorted(module.__all__):
            thing = getattr(module, name)
            if inspect.isclass(thing) or inspect.isroutine(thing):
                yield prefix + name, thing


def definition(thing: Any) -> Definition:
    """The stub's definition of what is compiled, the source's of the rest."""
    if getattr(_native, thing.__name__, None) is thing:
        return STUB[thing.__name__]
    node = ast.parse(textwrap.dedent(inspect.getsource(thing))).body[0]
    assert isinstance(node, Definition)
    return node


def items(name: str, thing: Any) -> Iterator[Item]:
    """The item of a function; those of a class, its methods and its properties."""
    node, doc = definition(thing), inspect.getdoc(thing) or ""
    if isinstance(node, ast.FunctionDef):
        yield Item(name, "function", *signature(node), doc)
        return
    methods = {own.name: own for own in node.body if isinstance(own, ast.FunctionDef)}
    constructor = methods.get("__new__") or methods.get("__init__")
    parameters = signature(constructor)[0] if constructor else {}
    if "dataclass" in map(name_of, node.decorator_list):
        parameters = {own.target.id: ast.unparse(own.annotation) for own in fields(node)}
    kind = "exception" if issubclass(thing, Exception) else "class"
    yield Item(name, kind, parameters, "", doc)
    for member, own in methods.items():
        said = inspect.getdoc(getattr(thing, member)) or ""
        if "property" in map(name_of, own.decorator_list):
            yield Item(f"{name}.{member}", "property", {}, ast.unparse(own.returns), said)
        elif member == "__call__":
            # what Python shows there is not the docstring: the class says what a call does
            yield Item(f"{name}.{member}", "call", *signature(own), of_call(doc))
        elif not member.startswith("_"):
            yield Item(f"{name}.{member}", "method", *signature(own), said)


def signature(node: ast.FunctionDef) -> tuple[dict[str, str], str]:
    """Annotations of the parameters, and of the return value unless it is None."""
    arguments = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
    own = [one for one in arguments if one.arg not in ("self", "cls")]
    returns = ast.unparse(node.returns) if node.returns else ""
    annotations = {one.arg: ast.unparse(one.annotation) if one.annotation else "" for one in own}
    return annotations, "" if returns == "None" else returns


def name_of(decorator: ast.expr) -> str:
    """The last name of a decorator, called or not."""
    call = decorator.func if isinstance(decorator, ast.Call) else decorator
    return call.attr if isinstance(call, ast.Attribute) else getattr(call, "id", "")


def fields(node: ast.ClassDef) -> Iterator[Any]:
    """The fields of a dataclass."""
    return (own for own in node.body if isinstance(own, ast.AnnAssign))


def of_call(doc: str) -> str:
    """What the section `Methods` of a class says of a call."""
    methods = entries(Item("", "class", {}, "", doc).sections.get("Methods", ""))
    return "\n".join(f"{head}\n{text}" for head, text in methods if head.startswith("__call__"))


WALKED = [item for name, thing in public() for item in items(name, thing)]
