// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/volume.h"
#include "translate/context/context.h"

#include <map>
#include <optional>
#include <string>

namespace velatura::translate::volumes {

/// What a field of a volume is for, by the name after `field:`.
enum class FieldRole { Density, Emission, Temperature, Color };

/// Volume prim under `matrix` (into the space of the holder), its fields named and not read;
/// nullopt with a warning when nothing of it can be rendered.
std::optional<scene::Volume> read_volume(Context& ctx, Prim prim, const Mat4d& matrix);

/// What the prim, or the volume shader of its material, says of what its fields do to light. Field
/// names that the shader reads by another input than their own go to `roles`.
scene::VolumeOptics read_volume_optics(Context& ctx,
                                       Prim prim,
                                       std::map<std::string, FieldRole>& roles);

}  // namespace velatura::translate::volumes
