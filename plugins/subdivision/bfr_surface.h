// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "geometry/subdivider.h"
#include "plugins/subdivision/cage.h"
#include "plugins/subdivision/channels.h"
#include "plugins/subdivision/point_layout.h"
#include "plugins/subdivision/shared_points.h"

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace velatura::plugins::subdivision {

/// A limit surface by OpenSubdiv's "base face representation": faces are evaluated one by one, from
/// the polygons around them, without a refined mesh.
class BfrSurface final : public geometry::LimitSurface {
  public:
    BfrSurface(const scene::Mesh& mesh, Cage cage, bool stays);

    uint32_t edge_count() const override { return shared_.edge_count(); }

    std::span<const uint32_t> edge_of_corner() const override { return shared_.edge_of_corner; }

    std::span<const uint8_t> has_face() const override { return shared_.has_face; }

    std::span<const std::array<Vec3, 3>> edge_points() const override { return edge_points_; }

    Result<geometry::DicedMesh> dice(std::span<const uint32_t> rates) const override;

  private:
    template <class Visit>
    void for_each_face(const Visit& visit) const;
    std::vector<std::array<Vec3, 3>> find_edge_points() const;
    void allocate(const PointLayout& layout, geometry::TriangleMeshData& data) const;
    void write_points(const PointLayout& layout,
                      std::span<const uint32_t> rates,
                      geometry::TriangleMeshData& data) const;
    void write_triangles(const PointLayout& layout,
                         std::span<const uint32_t> rates,
                         geometry::TriangleMeshData& data) const;

    const scene::Mesh& mesh_;
    Cage cage_;
    SharedPoints shared_;
    Channels channels_;
    std::vector<std::array<Vec3, 3>> edge_points_;
};

class OpenSubdivSubdivider final : public geometry::Subdivider {
  public:
    Result<std::unique_ptr<geometry::LimitSurface>> make(const scene::Mesh& mesh,
                                                         bool stays) const override;
};

}  // namespace velatura::plugins::subdivision
