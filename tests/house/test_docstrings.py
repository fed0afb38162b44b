"""Every public object says what it takes, in which unit, and shows a runnable example."""

import doctest
import inspect
import re

import pleinair as pa
import pleinair._explore
import pytest

MODULES = [
    pleinair._explore,
    pa.astro,
    pa.batch,
    pa.camera,
    pa.clouds,
    pa.color,
    pa.demo,
    pa.exports,
    pa.fit,
    pa.image,
    pa.io,
    pa.paint,
    pa.plants,
    pa.report,
    pa.scene,
    pa.sky,
    pa.tone,
]
# What may stand in brackets as a unit; two numbers there are a range.
UNITS = {
    *(
        "1",
        "m",
        "km",
        "1/m",
        "1/s",
        "m/s",
        "°",
        "turns",
        "s",
        "px",
        "byte",
        "K",
        "K/m",
        "hPa",
        "au",
        "DU",
        "mag",
        "S10",
        "EV",
    ),
    *("cd/m²", "lx", "W/m²", "relative", "unit", "its unit", "as in `Params`", "the same unit", "unit of the picture"),
    *("dome radii", "thickness", "1/thickness", "O'Neil's thickness", "m, or any unit of the scene"),
}


def has_unit(entry):
    return any(inner in UNITS for inner in re.findall(r"\[([^\[\]]*)\]", entry))


def test_a_range_is_no_unit():
    assert has_unit("float\n In [0, 1] [1].")
    assert has_unit("float\n Light [cd/m²].")
    for none in ("float\n In [0, 1].", "float", "float\n In [-90, 90].", "int\n Which of `names[k]`.", "[]"):
        assert not has_unit(none), none


def public():
    found = {}
    for module in MODULES:
        for name in module.__all__:
            thing = getattr(module, name)
            if not callable(thing) or (inspect.isclass(thing) and issubclass(thing, Exception)):
                continue
            found[f"{module.__name__}.{name}"] = thing
            if inspect.isclass(thing):
                for key, member in vars(thing).items():
                    member = getattr(member, "__func__", member)
                    if not key.startswith("_") and (inspect.isfunction(member) or isinstance(member, property)):
                        found[f"{module.__name__}.{name}.{key}"] = member
    return found


PUBLIC = public()


def text(thing):
    return inspect.getdoc(thing) or ""


def parameters(thing):
    """Names and numpydoc entries of the section Parameters."""
    section = re.search(r"^Parameters\n-+\n(.*?)(?=^\w[\w ]*\n-+\n|\Z)", text(thing), re.DOTALL | re.MULTILINE)
    entries = {}
    name = None
    for line in (section.group(1) if section else "").splitlines():
        head = re.match(r"^(\*{0,2}\w+(?:, \*{0,2}\w+)*) : (.*)$", line)
        if head:
            for name in head.group(1).replace("*", "").split(", "):
                entries[name] = head.group(2)
            names = head.group(1).replace("*", "").split(", ")
        elif name and line.strip():
            for n in names:
                entries[n] += " " + line.strip()
    return entries


def test_there_is_something_to_check():
    assert len(PUBLIC) > 40


@pytest.mark.parametrize("name", PUBLIC)
def test_it_is_described_and_has_an_example(name):
    thing = PUBLIC[name]
    doc = text(thing)
    assert len(doc.split(".")[0]) > 8, "a sentence"
    is_record = inspect.isclass(thing) and "Attributes\n---" in doc
    # A method may point to the function whose example runs it.
    elsewhere = re.search(r"^Examples\n-+\nSee `(\w+)`", doc, re.MULTILINE)
    if elsewhere:
        assert elsewhere.group(1) in {n.split(".")[-1] for n in PUBLIC}
    elif not is_record and not isinstance(thing, property):
        assert doctest.DocTestParser().get_examples(doc), "a runnable example"


@pytest.mark.parametrize("name", [n for n, t in PUBLIC.items() if not isinstance(t, property)])
def test_parameters_are_listed_and_floats_carry_units(name):
    thing = PUBLIC[name]
    listed = parameters(thing)
    if inspect.isclass(thing) and "Attributes\n---" in text(thing):
        return
    signature = inspect.signature(thing)
    wanted = [p for p in signature.parameters if p not in ("self", "cls", "args", "kwargs", "value", "names")]
    for parameter in wanted:
        assert parameter in listed, f"{parameter} is not described"
        kind = str(signature.parameters[parameter].annotation)
        if re.search(r"\b(float|int)\b", kind) and "bool" not in kind and "Callable" not in kind:
            assert has_unit(listed[parameter]), f"{parameter} has no unit: {listed[parameter]}"
