// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "geometry/level_set_cell.h"
#include "geometry/primitive_set.h"
#include "scene/voxel_grid.h"

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace velatura::geometry {

/// The surface where the numbers of a grid go through 0, met as it is, cell by cell, in lattice
/// coordinates. A primitive is the part of it in one brick (docs/adr/0027).
///
/// Closed to rays: which cells a ray goes through follows from when it meets their faces, which all
/// bricks compute alike, and cells agree on the numbers at faces. So whoever comes from outside to
/// inside is seen in one cell to change sides. What grids lose (a jump to empty space) is no
/// surface.
class LevelSet final : public PrimitiveSet {
  public:
    /// Nothing where no cell has corners on both sides.
    static std::shared_ptr<const LevelSet> make(std::shared_ptr<const scene::VoxelGrid> grid);

    const char* kind() const override { return "level set brick"; }

    uint32_t size() const override { return uint32_t(bricks_.size()); }

    PrimitiveBounds bounds(uint32_t index) const override;

    std::optional<PrimitiveHit> intersect(uint32_t index,
                                          const Vec3d& o,
                                          const Vec3d& d,
                                          float t_max) const override;

    PrimitiveSurface surface(uint32_t index,
                             const Vec3d& o,
                             const Vec3d& d,
                             const PrimitiveHit& hit) const override;

    bool tangents(
        uint32_t, uint32_t, const Vec3d&, const PrimitiveHit&, Vec3d&, Vec3d&) const override {
        return false;
    }

    size_t bytes() const override;

    double area(uint32_t index) const override;

    Vec3d point(uint32_t index, const Vec2d& u) const override;

  private:
    struct Brick {
        scene::Vec3i first;  ///< point
        size_t first_value;
        /// Cells with corners on both sides are in [low, high), lattice coordinates.
        scene::Vec3i low, high;
        uint32_t mixed = 0;  ///< how many
    };

    /// Where a ray crosses the surface.
    struct Crossing {
        double t;
        scene::Vec3i cell;
        Vec3d local;  ///< in the cell
    };

    explicit LevelSet(std::shared_ptr<const scene::VoxelGrid> grid) : grid_(std::move(grid)) {}

    void add_brick(const scene::Vec3i& first, const scene::VoxelGrid::Brick& brick);
    LevelSetCell cell_of(const Brick& brick, const scene::Vec3i& cell) const;
    /// Calls use(Crossing) in the order along the ray until it returns true.
    template <class Use>
    void for_each_crossing(
        const Brick& brick, const Vec3d& o, const Vec3d& d, double t_end, const Use& use) const;
    Crossing nearest_crossing(const Brick& brick, const Vec3d& o, const Vec3d& d, double t) const;
    bool find_number(const scene::Vec3i& point, double& number) const;
    Vec3d gradient_at(const scene::Vec3i& point, double number) const;
    void set_smooth_normal(const Brick& brick, const Crossing& at, PrimitiveSurface& out) const;

    std::shared_ptr<const scene::VoxelGrid> grid_;
    std::vector<Brick> bricks_;
};

}  // namespace velatura::geometry
