// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "geometry/dicing.h"
#include "geometry/displacement.h"
#include "geometry/subdivider.h"
#include "geometry/triangle_mesh.h"
#include "scene/scene.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace velatura::geometry {

struct RefinementStats {
    size_t meshes = 0;          ///< refined, prototypes once
    size_t faces = 0;           ///< that they had before
    size_t displaced = 0;       ///< meshes, refined or not
    size_t polygon_meshes = 0;  ///< with a scheme, and rendered as their polygons
    uint64_t triangles = 0;     ///< made
    uint64_t bytes = 0;         ///< of the triangles with normals and primvars
    double rate = 0;            ///< pixels per edge; 0: uniform
    int level = -1;             ///< of a uniform refinement
    double seconds = 0;
};

/// The subdivided meshes of a scene, ready for a GeometrySet.
struct Refinement {
    using Meshes = std::vector<std::optional<TriangleMeshData>>;
    Meshes shapes;                   ///< [shape of Scene::shapes]; nothing: as GeometrySet does
    std::vector<Meshes> prototypes;  ///< [prototype][shape]
    RefinementStats stats;

    /// The mesh of a shape as ListedShape names it; nullptr where there is none.
    std::optional<TriangleMeshData>* find(uint32_t prototype, size_t index) {
        const bool is_known =
            prototype == scene::none ? index < shapes.size() : prototype < prototypes.size();
        if (!is_known) return nullptr;
        auto& mesh = (prototype == scene::none ? shapes : prototypes[prototype])[index];
        return mesh ? &mesh : nullptr;
    }
};

/// The first shape that asks for subdivision; nullptr when none does.
const scene::Shape* first_subdivided(const scene::Scene& scene);

/// Who makes surfaces finer and who moves them; nullptr: nobody.
struct RefinementTools {
    const Subdivider* subdivider = nullptr;
    const Displacer* displacer = nullptr;
};

/// Refines every mesh that asks for it, then moves those with displacement, in parallel; the result
/// does not depend on the number of threads. Prototypes are cut for the instance in which they are
/// largest in the image. Meshes without a limit surface are left to be polygons with the warning
/// "subdivision", displaced ones that are polygons get "displacement", and where all would be more
/// triangles than allowed, they are cut more coarsely with "dicing-limit".
Refinement refine(const scene::Scene& scene,
                  const RefinementTools& tools,
                  const DicingOptions& options,
                  const DicingView& view,
                  Diagnostics& diagnostics);

}  // namespace velatura::geometry
