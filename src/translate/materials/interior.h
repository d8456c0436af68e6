// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/material.h"
#include "translate/context/context.h"
#include "translate/materials/materials.h"

#include <optional>

namespace velatura::translate::materials {

/// The interior medium that the volume output of a material asks for: absorption_vdf or
/// anisotropic_vdf of MaterialX, by themselves or within `volume`. Nothing where there is none, or,
/// with a warning, another shader.
std::optional<scene::MediumProperties> read_interior(Context& ctx,
                                                     Prim material,
                                                     MaterialEntry& entry);

/// Whether the material has a surface of some kind, known or not.
bool has_surface_output(Prim material);

/// Whether its volume output leads anywhere.
bool has_volume_output(Prim material);

/// A material of a medium without a surface.
scene::Material bare_interior(const scene::MediumProperties& medium);

/// Fills what the material bounds with the medium; a warning where it bounds nothing.
void fill_interior(Context& ctx,
                   Prim prim,
                   const scene::MediumProperties& medium,
                   scene::Material& material);

/// Makes the scattering of an interior one that can be simulated; warnings at `from`.
void check_scatter(Context& ctx, const Attribute& from, scene::Material& material);

}  // namespace velatura::translate::materials
