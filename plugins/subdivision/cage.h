// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "scene/mesh.h"

#include <opensubdiv/bfr/refinerSurfaceFactory.h>
#include <opensubdiv/bfr/surfaceFactoryCache.h>
#include <opensubdiv/far/topologyRefiner.h>

#include <memory>
#include <mutex>
#include <shared_mutex>
#include <vector>

namespace velatura::plugins::subdivision {

namespace Bfr = OpenSubdiv::Bfr;
namespace Far = OpenSubdiv::Far;
namespace Sdc = OpenSubdiv::Sdc;

/// Makes surfaces of faces, for many threads at a time.
using SurfaceFactory = Bfr::RefinerSurfaceFactory<
    Bfr::SurfaceFactoryCacheThreaded<std::shared_mutex,
                                     std::shared_lock<std::shared_mutex>,
                                     std::unique_lock<std::shared_mutex>>>;

/// The connected polygons of a mesh.
struct Cage {
    std::unique_ptr<const Far::TopologyRefiner> refiner;  ///< base level only
    std::unique_ptr<const SurfaceFactory> factory;
    std::vector<size_t> face_varying;  ///< [channel] primvar of the mesh
};

/// Errors: "subdivision", where the polygons make no surface that has a limit everywhere.
Result<Cage> make_cage(const scene::Mesh& mesh);

}  // namespace velatura::plugins::subdivision
