# SPDX-License-Identifier: Apache-2.0
"""Velatura: a path tracer for USD scenes that keeps every light and every bounce as a layer.

    import velatura
    frame = velatura.render("shot.usda", spp=64, res=(640, 360))
    frame.layers["b1"]          # direct light, a NumPy array [height, width, channel]
    frame.write("shot.exr")     # the file that `velatura render` writes
"""
import json
import pathlib

from . import _native
from ._native import (Attribute, Diagnostic, Frame, Layers, Look, Prim, Progress, Renderer, SceneBuilder, Stage,
                      __version__)

__all__ = ["Attribute", "Canceled", "Diagnostic", "Error", "Frame", "Layers", "Look", "Prim", "Progress", "Renderer", "SceneBuilder", "Stage",
           "UsageError", "__version__", "plan", "read_study", "render", "render_options"]


class Error(Exception):
    """A scene, file or render error. The text has file:line:column where it is known.

    code: the message code (docs/reference/messages.md). diagnostics: errors, warnings and notes before it.
    """

    code = ""
    diagnostics = ()


class UsageError(Error, ValueError):
    """A wrong value of an option."""


class Canceled(Error):
    """The render was canceled. frame: the image so far; None: not every pixel has a sample."""

    frame = None


def render(scene, *, progress=None, **options):
    """Renders one frame of a USD scene and returns a Frame.

    options: those of `velatura render`, with _ for -: spp=64, res=(1280, 720), bounces=2, time="30s", halves=True;
    render_options() lists them. With output="shot.exr" the file is written, too.
    progress(Progress): called in this thread, up to 50 times a second; False cancels.
    Raises Error, UsageError, Canceled, and TypeError for an unknown option.
    """
    return Renderer(scene, **options).render(progress)


def plan(scene, **options):
    """Effects, plugins, memory and files of a render with these options: `velatura plan --json` as a dict."""
    return Renderer(scene, **options).plan


def read_study(folder):
    """The report of `velatura study -o FOLDER` as a dict. Raises Error."""
    path = pathlib.Path(folder) / "report.json"
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as why:
        raise Error(f"cannot read {path}: {why}") from why


def render_options():
    """Names of all options of render(), plan() and Renderer."""
    return _native.render_options()
