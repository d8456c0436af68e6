// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "translate/context/instance_source.h"
#include "translate/motion/pose.h"

#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

namespace velatura::translate::geometry {

/// Rendered faces of a mesh that a GeomSubset holds.
struct FaceSubset {
    usd::layer::Path path;
    std::vector<uint32_t> faces;
};

/// State of this module: the GeomSubsets of faces of every mesh.
struct FaceSubsets {
    std::unordered_map<scene::ProvenanceId, std::vector<FaceSubset>> of_mesh;  ///< by provenance
};

/// Shape of a Mesh prim under `matrix` (into the space of the holder), deformed by `pose`, whose
/// matrix leads there too, with its motion while the shutter is open; nullopt when nothing of it is
/// left.
std::optional<scene::Shape> read_mesh(Context& ctx,
                                      Prim prim,
                                      const InstanceSource& parent,
                                      const Mat4d& matrix,
                                      const motion::Pose* pose = nullptr);

/// A shape of a prototype, moved into another space.
scene::Shape baked(const scene::Shape& shape, const Mat4d& matrix);

}  // namespace velatura::translate::geometry
