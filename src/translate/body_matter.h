// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/material.h"
#include "translate/context.h"

#include <optional>

namespace velatura::translate {

/// What the volume output of a material fills its bodies with: absorption_vdf or anisotropic_vdf of
/// MaterialX, by themselves or within `volume`. Nothing where there is none, or, with a warning,
/// another shader.
std::optional<scene::Matter> read_matter(Context& ctx, Prim material, MaterialEntry& entry);

/// Whether the material has a surface of some kind, known or not.
bool has_surface_output(Prim material);

/// Whether its volume output leads anywhere.
bool has_volume_output(Prim material);

/// A body of matter that has no surface.
scene::Material bare_body(const scene::Matter& matter);

/// Puts the matter into what the material bounds; a warning where there is no room for it.
void fill_body(Context& ctx, Prim prim, const scene::Matter& matter, scene::Material& material);

/// Makes what scatters in a body something that can be simulated; warnings at `from`.
void check_scatter(Context& ctx, const Attribute& from, scene::Material& material);

}  // namespace velatura::translate
