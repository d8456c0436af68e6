// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace velatura::scene {

/// Indices into the vectors of Scene. `none` means "there is none".
using MaterialId = uint32_t;
using TextureId = uint32_t;
using PrimvarId = uint32_t;  ///< index of an interned primvar name, Scene::primvar_names
using PatternId = uint32_t;
using ShapeId = uint32_t;
using ProvenanceId = uint32_t;
using MeshLightId = uint32_t;
using GroupId = uint32_t;  ///< light group, index into Scene::groups

using CasterId = uint32_t;  ///< who casts a shadow, index into Casters::list

inline constexpr uint32_t none = 0xffffffffu;

}  // namespace velatura::scene
