// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "geometry/triangle_mesh.h"
#include "plugins/subdivision/cage.h"
#include "plugins/subdivision/channels.h"

#include <opensubdiv/bfr/surface.h>

#include <cstdint>
#include <vector>

namespace velatura::plugins::subdivision {

/// Evaluates the limit surface over one face after the other; one for each thread.
class FaceEvaluator {
  public:
    FaceEvaluator(const SurfaceFactory& factory, const Channels& channels);

    /// Turns to a face. False when OpenSubdiv makes no surface of it.
    bool start(uint32_t face);

    Bfr::Parameterization parameterization() const { return vertex_.GetParameterization(); }

    /// The point as the shutter opens.
    Vec3 position(const double uv[2]);

    /// Writes points and normals of all keys and the primvars into row `point` of the mesh.
    void write(const double uv[2], uint32_t point, geometry::TriangleMeshData& data);

  private:
    using Surface = Bfr::Surface<double>;

    /// A surface with the points of its patches.
    struct Patches {
        std::vector<double> points;
        std::vector<double> p, du, dv;

        void prepare(const Surface& surface, const Channel& channel);
    };

    void write_primvars(const Channel& channel,
                        const std::vector<double>& row,
                        uint32_t point,
                        geometry::TriangleMeshData& data) const;

    const SurfaceFactory& factory_;
    const Channels& channels_;
    Surface vertex_, varying_;
    std::vector<Surface> face_varying_;
    Patches vertex_patches_, varying_patches_;
    std::vector<Patches> face_varying_patches_;
};

}  // namespace velatura::plugins::subdivision
