// SPDX-License-Identifier: Apache-2.0
#include "plugins/volume/grid_conversion.h"

#include "media/voxel_builder.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <type_traits>
#include <vector>

namespace velatura::plugins::volume {

namespace {

using openvdb::Coord;
using openvdb::CoordBBox;
using scene::Vec3i;
using scene::VoxelGrid;

Error too_much(double bytes, size_t max_bytes) {
    return {"volume-memory",
            fmt::format("the grid needs {:.1f} GB, {:.1f} GB are free; raise --volume-memory",
                        bytes / 1e9, double(max_bytes) / 1e9)};
}

template <class Grid>
class Conversion {
  public:
    using Value = typename Grid::ValueType;
    static constexpr bool has_channels = !std::is_arithmetic_v<Value>;

    Conversion(const Grid& grid, const ConversionOptions& options)
        : grid_(grid),
          channels_(has_channels && options.is_color ? 3 : 1),
          is_level_set_(options.is_level_set) {}

    Result<VoxelGrid> run(size_t max_bytes) {
        CoordBBox box;
        if (!grid_.tree().evalLeafBoundingBox(box)) return empty();
        // Leaves that are read later count as if they were
        const double leaves = double(grid_.tree().leafCount());
        constexpr double voxels = 512;
        if (leaves * voxels * double(sizeof(Value)) > double(max_bytes))
            return too_much(leaves * voxels * double(sizeof(Value)), max_bytes);
        if (!grid_.tree().evalActiveVoxelBoundingBox(box)) return empty();
        place(box);
        const double nodes = double(node_count_.x) * double(node_count_.y) * double(node_count_.z) *
                             double(sizeof(uint32_t));
        if (nodes > double(max_bytes)) return too_much(nodes, max_bytes);
        const double bricks = find_bricks(max_bytes / brick_bytes());
        if (bricks * double(brick_bytes()) > double(max_bytes))
            return too_much(bricks * double(brick_bytes()), max_bytes);
        return fill(box);
    }

  private:
    size_t brick_bytes() const { return VoxelGrid::brick_values(channels_) * sizeof(float); }

    VoxelGrid empty() const {
        return media::VoxelGridBuilder(Vec3i(1), channels_, 0.0f, is_level_set_)
            .finish(Mat4d(), Vec3(0.0f), Vec3(0.0f));
    }

    /// The lattice begins with a leaf, one voxel before the first active one.
    void place(const CoordBBox& box) {
        const auto down = [](int64_t v) { return v >= 0 ? v / 8 * 8 : -((-v + 7) / 8 * 8); };
        for (int a = 0; a < 3; ++a) {
            first_[size_t(a)] = down(int64_t(box.min()[a]) - 1);
            count_[size_t(a)] = (int64_t(box.max()[a]) + 1 - first_[size_t(a)]) / 8 + 1;
            node_count_[a] =
                int((count_[size_t(a)] + VoxelGrid::node_bricks - 1) / VoxelGrid::node_bricks);
        }
    }

    /// Bricks that know a point of a box of voxels; those before it know its first points.
    void add_box(const Coord& min, const Coord& max) {
        int64_t from[3], to[3];
        for (int a = 0; a < 3; ++a) {
            from[a] = std::max<int64_t>((int64_t(min[a]) - first_[size_t(a)]) / 8 - 1, 0);
            to[a] =
                std::min<int64_t>((int64_t(max[a]) - first_[size_t(a)]) / 8, count_[size_t(a)] - 1);
        }
        for (int64_t z = from[2]; z <= to[2]; ++z)
            for (int64_t y = from[1]; y <= to[1]; ++y)
                for (int64_t x = from[0]; x <= to[0]; ++x)
                    bricks_.push_back((z * count_[1] + y) * count_[0] + x);
    }

    /// Finds the bricks that are more than empty space, unless there are more than `max_value`.
    /// Returns: how many there are at least.
    double find_bricks(size_t max_value) {
        const auto fits = [&] {
            // Neighbors name a brick up to 8 times
            if (bricks_.size() <= max_value) return true;
            std::sort(bricks_.begin(), bricks_.end());
            bricks_.erase(std::unique(bricks_.begin(), bricks_.end()), bricks_.end());
            return bricks_.size() <= max_value;
        };
        for (auto leaf = grid_.tree().cbeginLeaf(); leaf; ++leaf) {
            add_box(leaf->origin(), leaf->origin().offsetBy(7));
            if (!fits()) return double(bricks_.size());
        }
        auto tile = grid_.tree().cbeginValueOn();
        tile.setMaxDepth(int(decltype(tile)::LEAF_DEPTH) - 1);
        for (; tile; ++tile) {
            const CoordBBox box = tile.getBoundingBox();
            const double edge = double(box.dim().x()) / 8 + 1;
            if (edge * edge * edge > double(max_value)) return edge * edge * edge;
            add_box(box.min(), box.max());
            if (!fits()) return double(bricks_.size());
        }
        std::sort(bricks_.begin(), bricks_.end());
        bricks_.erase(std::unique(bricks_.begin(), bricks_.end()), bricks_.end());
        return double(bricks_.size());
    }

    Vec3i brick(size_t i) const {
        const int64_t x = bricks_[i] % count_[0], yz = bricks_[i] / count_[0];
        return {int(x), int(yz % count_[1]), int(yz / count_[1])};
    }

    /// The points of one brick.
    void read_brick(const Vec3i& brick, float* out) const {
        const auto accessor = grid_.getConstUnsafeAccessor();
        constexpr int n = VoxelGrid::brick_points;
        const Coord first = {int(first_[0]) + brick.x * 8, int(first_[1]) + brick.y * 8,
                             int(first_[2]) + brick.z * 8};
        for (int z = 0; z < n; ++z)
            for (int y = 0; y < n; ++y)
                for (int x = 0; x < n; ++x) {
                    const Value& value = accessor.getValue(first.offsetBy(x, y, z));
                    if constexpr (has_channels) {
                        for (int c = 0; c < channels_; ++c) *out++ = float(value[c]);
                    } else {
                        *out++ = float(value);
                    }
                }
    }

    VoxelGrid fill(const CoordBBox& box) {
        const Value& background = grid_.background();
        float outside = 0.0f;
        if constexpr (has_channels)
            outside = float(background[0]);
        else
            outside = float(background);
        media::VoxelGridBuilder builder(node_count_, channels_, outside, is_level_set_);
        std::vector<float> values(VoxelGrid::brick_values(channels_));
        for (size_t i = 0; i < bricks_.size(); ++i) {
            read_brick(brick(i), values.data());
            builder.add(brick(i), values);
        }
        Vec3 near, far;
        for (int a = 0; a < 3; ++a) {
            near[a] = float(int64_t(box.min()[a]) - 1 - first_[size_t(a)]);
            far[a] = float(int64_t(box.max()[a]) + 1 - first_[size_t(a)]);
        }
        return builder.finish(volume_from_lattice(), near, far);
    }

    /// By where the transform puts points, whatever kind of map it is.
    Mat4d volume_from_lattice() const {
        const openvdb::Vec3d first = {double(first_[0]), double(first_[1]), double(first_[2])};
        const openvdb::Vec3d origin = grid_.transform().indexToWorld(first);
        Mat4d m;
        for (int a = 0; a < 3; ++a) {
            openvdb::Vec3d next = first;
            next[a] += 1.0;
            const openvdb::Vec3d axis = grid_.transform().indexToWorld(next) - origin;
            for (int c = 0; c < 3; ++c) m[a][c] = axis[c];
            m[3][a] = origin[a];
        }
        return m;
    }

    const Grid& grid_;
    int channels_;
    bool is_level_set_;
    std::array<int64_t, 3> first_ = {}, count_ = {};  // voxels, bricks
    Vec3i node_count_ = Vec3i(0);
    std::vector<int64_t> bricks_;
};

template <class Grid>
bool try_as(const openvdb::GridBase& grid,
            const ConversionOptions& options,
            Result<VoxelGrid>& out) {
    if (!grid.isType<Grid>()) return false;
    out = Conversion<Grid>(static_cast<const Grid&>(grid), options).run(options.max_bytes);
    return true;
}

}  // namespace

Result<VoxelGrid> convert(const openvdb::GridBase& grid, const ConversionOptions& options) {
    Result<VoxelGrid> out = Error{
        "volume-grid", fmt::format("grid {} is of type {}, expected numbers{}", grid.getName(),
                                   grid.valueType(), options.is_color ? " or colors" : "")};
    if (try_as<openvdb::FloatGrid>(grid, options, out) ||
        try_as<openvdb::DoubleGrid>(grid, options, out) ||
        try_as<openvdb::Int32Grid>(grid, options, out))
        return out;
    if (options.is_color && (try_as<openvdb::Vec3SGrid>(grid, options, out) ||
                             try_as<openvdb::Vec3DGrid>(grid, options, out)))
        return out;
    return out;
}

}  // namespace velatura::plugins::volume
