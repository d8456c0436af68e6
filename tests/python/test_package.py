# SPDX-License-Identifier: Apache-2.0
"""The package as a whole: names, type stubs, docstrings."""
import ast
import inspect
import pathlib

import velatura
from velatura import _native

STUB = pathlib.Path(velatura.__file__).with_name("_native.pyi")


def stub_names():
    """Class or "" -> names."""
    tree = ast.parse(STUB.read_text())
    names = {"": set()}
    for node in tree.body:
        if isinstance(node, ast.FunctionDef):
            names[""].add(node.name)
        elif isinstance(node, ast.ClassDef):
            names[node.name] = {n.name for n in node.body if isinstance(n, ast.FunctionDef)}
    return names


def module_names():
    names = {"": {n for n, v in vars(_native).items() if callable(v) and not inspect.isclass(v)}}
    for name, value in vars(_native).items():
        if inspect.isclass(value):
            names[name] = {n for n in vars(value) if not n.startswith("_")}
    return names


def test_the_stub_has_all_names_of_the_module_and_no_others():
    stub, module = stub_names(), module_names()
    assert stub.keys() == module.keys()
    for name in module:
        assert {n for n in stub[name] if not n.startswith("_")} == module[name], name


def test_everything_public_has_a_docstring():
    for name in velatura.__all__:
        value = getattr(velatura, name)
        if name.startswith("__"):
            continue
        assert value.__doc__, name
        for member, what in vars(value).items() if inspect.isclass(value) and value.__module__ == "velatura._native" else ():
            if not member.startswith("_") and member not in ("name", "value"):
                assert getattr(what, "__doc__", None), f"{name}.{member}"


def test_the_package_is_typed():
    assert STUB.with_name("py.typed").exists()
