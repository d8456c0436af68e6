// SPDX-License-Identifier: Apache-2.0
#include "geometry/level_set.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace velatura::geometry {

using scene::Vec3i;
using scene::VoxelGrid;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// A line through cells of a lattice. Planes between cells are met at times that depend on the line
/// and the plane alone, and in one order: by time, then by axis.
/// Ref: Amanatides & Woo 1987, "A Fast Voxel Traversal Algorithm for Ray Tracing".
class CellWalk {
  public:
    struct Event {
        double t;
        int axis;  ///< −1: before all others at that time

        bool operator<(const Event& o) const { return t < o.t || (t == o.t && axis < o.axis); }
    };

    /// From t = 0 through the cells in [low, high).
    CellWalk(const Vec3d& o, const Vec3d& d, const Vec3i& low, const Vec3i& high)
        : o_(o), d_(d), low_(low), high_(high) {
        for (int a = 0; a < 3; ++a) inverse_[a] = d[a] != 0.0 ? 1.0 / d[a] : 0.0;
    }

    /// False: the line goes past them.
    bool enter() {
        Event entry{0.0, -1}, exit{infinity, 3};
        for (int a = 0; a < 3; ++a) {
            if (d_[a] == 0.0) {
                if (o_[a] < double(low_[a]) || o_[a] > double(high_[a])) return false;
                continue;
            }
            entry = std::max(entry, plane(a, d_[a] > 0.0 ? low_[a] : high_[a]));
            exit = std::min(exit, plane(a, d_[a] > 0.0 ? high_[a] : low_[a]));
        }
        // Also those that are touched in one point only
        if (!(entry.t <= exit.t)) return false;
        entry_ = entry;
        for (int a = 0; a < 3; ++a) cell_[a] = first_cell(a);
        find_exit();
        return true;
    }

    /// False: it was the last one.
    bool next_cell() {
        const int a = exit_.axis;
        if (a > 2) return false;
        cell_[a] += d_[a] > 0.0 ? 1 : -1;
        if (cell_[a] < low_[a] || cell_[a] >= high_[a]) return false;
        entry_ = exit_;
        find_exit();
        return true;
    }

    const Vec3i& cell() const { return cell_; }

    const Event& entry() const { return entry_; }

    const Event& exit() const { return exit_; }

    /// Where in the cell the line is at an end of its way there: on a face exactly.
    Vec3d local(const Event& at, bool is_exit) const {
        Vec3d p;
        for (int a = 0; a < 3; ++a)
            p[a] = std::clamp(o_[a] + d_[a] * at.t - double(cell_[a]), 0.0, 1.0);
        if (at.axis >= 0 && at.axis < 3) p[at.axis] = (d_[at.axis] > 0.0) == is_exit ? 1.0 : 0.0;
        return p;
    }

  private:
    Event plane(int a, int number) const { return {(double(number) - o_[a]) * inverse_[a], a}; }

    /// The cell that the planes which were met before the entry lead to.
    int first_cell(int a) const {
        const double guess = std::floor(o_[a] + d_[a] * entry_.t);
        int cell = int(std::clamp(guess, double(low_[a]), double(high_[a] - 1)));
        if (d_[a] == 0.0) return cell;
        const auto is_met = [&](int number) { return !(entry_ < plane(a, number)); };
        if (d_[a] > 0.0) {
            while (cell + 1 < high_[a] && is_met(cell + 1)) ++cell;
            while (cell > low_[a] && !is_met(cell)) --cell;
        } else {
            while (cell > low_[a] && is_met(cell)) --cell;
            while (cell + 1 < high_[a] && !is_met(cell + 1)) ++cell;
        }
        return cell;
    }

    void find_exit() {
        exit_ = {infinity, 3};
        for (int a = 0; a < 3; ++a)
            if (d_[a] != 0.0) exit_ = std::min(exit_, plane(a, cell_[a] + int(d_[a] > 0.0)));
    }

    const Vec3d& o_;
    const Vec3d& d_;
    Vec3d inverse_;
    Vec3i low_, high_, cell_;
    Event entry_{0.0, -1}, exit_{0.0, -1};
};

Vec3d to_double(const Vec3i& v) {
    return {double(v.x), double(v.y), double(v.z)};
}

/// Calls visit(first point, brick) for each brick that has values.
template <class Visit>
void for_each_brick(const VoxelGrid& grid, const Visit& visit) {
    constexpr int n = VoxelGrid::node_bricks;
    size_t node = 0;
    Vec3i at;
    for (at.z = 0; at.z < grid.node_count.z; ++at.z)
        for (at.y = 0; at.y < grid.node_count.y; ++at.y)
            for (at.x = 0; at.x < grid.node_count.x; ++at.x) {
                const uint32_t entry = grid.nodes[node++];
                if (!(entry & VoxelGrid::is_node)) continue;
                const auto& bricks = grid.node_entries[entry & ~VoxelGrid::is_node];
                for (int i = 0; i < n * n * n; ++i) {
                    const Vec3i within(i % n, i / n % n, i / (n * n));
                    const VoxelGrid::Brick& brick = grid.bricks[bricks[size_t(i)]];
                    if (!brick.is_constant())
                        visit((at * n + within) * VoxelGrid::brick_cells, brick);
                }
            }
}

}  // namespace

std::shared_ptr<const LevelSet> LevelSet::make(std::shared_ptr<const VoxelGrid> grid) {
    if (!grid || grid->channels != 1) return nullptr;
    const std::shared_ptr<LevelSet> set(new LevelSet(std::move(grid)));
    for_each_brick(*set->grid_, [&](const Vec3i& first, const VoxelGrid::Brick& brick) {
        if (LevelSetCell::is_inside(double(brick.min)) &&
            !LevelSetCell::is_inside(double(brick.max)))
            set->add_brick(first, brick);
    });
    return set->bricks_.empty() ? nullptr : set;
}

void LevelSet::add_brick(const Vec3i& first, const VoxelGrid::Brick& values) {
    Brick brick{first, values.first_value, first + Vec3i(VoxelGrid::brick_cells), first};
    constexpr int n = VoxelGrid::brick_cells;
    for (int i = 0; i < n * n * n; ++i) {
        const Vec3i cell = first + Vec3i(i % n, i / n % n, i / (n * n));
        if (!cell_of(brick, cell).is_mixed()) continue;
        ++brick.mixed;
        for (int a = 0; a < 3; ++a) {
            brick.low[a] = std::min(brick.low[a], cell[a]);
            brick.high[a] = std::max(brick.high[a], cell[a] + 1);
        }
    }
    if (brick.mixed > 0) bricks_.push_back(brick);
}

LevelSetCell LevelSet::cell_of(const Brick& brick, const Vec3i& cell) const {
    constexpr size_t n = VoxelGrid::brick_points;
    const Vec3i at = cell - brick.first;
    const float* const v = grid_->values.data() + brick.first_value +
                           (size_t(at.z) * n + size_t(at.y)) * n + size_t(at.x);
    LevelSetCell out;
    for (size_t i = 0; i < 8; ++i) out.corner[i] = double(v[(i / 4 * n + i / 2 % 2) * n + i % 2]);
    return out;
}

PrimitiveBounds LevelSet::bounds(uint32_t index) const {
    const Brick& brick = bricks_[index];
    const Vec3d low = to_double(brick.low), high = to_double(brick.high);
    // Times at which planes are met are rounded, and so are places there
    const double pad = 0x1p-46 * (std::max({high.x, high.y, high.z}) + 1.0);
    return {Box3d(low - Vec3d(pad), high + Vec3d(pad))};
}

template <class Use>
void LevelSet::for_each_crossing(
    const Brick& brick, const Vec3d& o, const Vec3d& d, double t_end, const Use& use) const {
    CellWalk walk(o, d, brick.low, brick.high);
    for (bool is_within = walk.enter(); is_within; is_within = walk.next_cell()) {
        const CellWalk::Event &entry = walk.entry(), &exit = walk.exit();
        if (!(entry.t < t_end)) return;
        const LevelSetCell cell = cell_of(brick, walk.cell());
        if (!cell.is_mixed()) continue;
        const Vec3d p = walk.local(entry, false), q = walk.local(exit, true);
        const LevelSetCell::Crossings found = cell.crossings(p, q);
        for (int i = 0; i < found.count; ++i) {
            const double s = found.at[size_t(i)];
            const double t = entry.t + (exit.t - entry.t) * s;
            if (use(Crossing{t, walk.cell(), p * (1.0 - s) + q * s})) return;
        }
    }
}

std::optional<PrimitiveHit> LevelSet::intersect(uint32_t index,
                                                const Vec3d& o,
                                                const Vec3d& d,
                                                float t_max) const {
    std::optional<PrimitiveHit> hit;
    for_each_crossing(bricks_[index], o, d, infinity, [&](const Crossing& at) {
        const auto t = float(at.t);
        if (!(t > 0.0f)) return false;
        if (t < t_max) hit = PrimitiveHit{at.t};
        return true;
    });
    return hit;
}

LevelSet::Crossing LevelSet::nearest_crossing(const Brick& brick,
                                              const Vec3d& o,
                                              const Vec3d& d,
                                              double t) const {
    std::optional<Crossing> nearest;
    for_each_crossing(brick, o, d, infinity, [&](const Crossing& at) {
        if (nearest && std::abs(nearest->t - t) <= std::abs(at.t - t)) return true;
        nearest = at;
        return false;
    });
    if (nearest) return *nearest;
    // A ray that starts on the surface, behind it by rounding: the place itself
    const Vec3d p = o + d * t;
    Crossing here{t, Vec3i(0), Vec3d(0.0)};
    for (int a = 0; a < 3; ++a) {
        const double cell =
            std::clamp(std::floor(p[a]), double(brick.low[a]), double(brick.high[a] - 1));
        here.cell[a] = int(cell);
        here.local[a] = std::clamp(p[a] - cell, 0.0, 1.0);
    }
    return here;
}

PrimitiveSurface LevelSet::surface(uint32_t index,
                                   const Vec3d& o,
                                   const Vec3d& d,
                                   const PrimitiveHit& hit) const {
    const Brick& brick = bricks_[index];
    const Crossing at = nearest_crossing(brick, o, d, hit.t);
    const LevelSetCell cell = cell_of(brick, at.cell);
    PrimitiveSurface surface;
    surface.p = to_double(at.cell) + at.local;
    surface.facet_n = cell.gradient(at.local);
    // What rounding does to numbers moves the place by the more, the slower they change
    double max = 0;
    for (const double v : cell.corner) max = std::max(max, std::abs(v));
    constexpr double widest_error = 0x1p-10;
    const double slope = surface.facet_n.length();
    const double of_numbers = slope > 0.0 ? 0x1p-48 * max / slope : widest_error;
    const double reach = std::max({surface.p.x, surface.p.y, surface.p.z}) + 1.0;
    surface.error = Vec3d(std::min(of_numbers + 0x1p-48 * reach, widest_error));
    if (!(slope > 0.0)) surface.facet_n = -d;
    set_smooth_normal(brick, at, surface);
    return surface;
}

/// A number of the grid; false where no brick holds it.
bool LevelSet::find_number(const Vec3i& point, double& number) const {
    constexpr int node_cells = VoxelGrid::node_cells, cells = VoxelGrid::brick_cells,
                  n = VoxelGrid::node_bricks, points = VoxelGrid::brick_points;
    for (int a = 0; a < 3; ++a)
        if (point[a] < 0 || point[a] >= grid_->node_count[a] * node_cells) return false;
    const Vec3i node = point / node_cells, brick = point / cells, in = point - brick * cells;
    const uint32_t entry =
        grid_->nodes[(size_t(node.z) * size_t(grid_->node_count.y) + size_t(node.y)) *
                         size_t(grid_->node_count.x) +
                     size_t(node.x)];
    if (!(entry & VoxelGrid::is_node)) return false;
    const auto& bricks = grid_->node_entries[entry & ~VoxelGrid::is_node];
    const VoxelGrid::Brick& found =
        grid_->bricks[bricks[size_t((brick.z % n * n + brick.y % n) * n + brick.x % n)]];
    if (found.is_constant()) return false;
    number =
        double(grid_->values[found.first_value + size_t((in.z * points + in.y) * points + in.x)]);
    return true;
}

/// By central differences, one-sided where the grid ends.
Vec3d LevelSet::gradient_at(const Vec3i& point, double number) const {
    Vec3d gradient;
    for (int a = 0; a < 3; ++a) {
        Vec3i step(0);
        step[a] = 1;
        double before = number, behind = number;
        const bool has_before = find_number(point - step, before);
        const bool has_behind = find_number(point + step, behind);
        gradient[a] = (behind - before) / (has_before && has_behind ? 2.0 : 1.0);
    }
    return gradient;
}

/// Trilinear between gradients at the corners: without the edges that those of the cells have.
void LevelSet::set_smooth_normal(const Brick& brick,
                                 const Crossing& at,
                                 PrimitiveSurface& out) const {
    const LevelSetCell numbers = cell_of(brick, at.cell);
    std::array<LevelSetCell, 3> gradients;
    for (size_t i = 0; i < 8; ++i) {
        const Vec3i corner = at.cell + Vec3i(int(i % 2), int(i / 2 % 2), int(i / 4));
        const Vec3d g = gradient_at(corner, numbers.corner[i]);
        for (int a = 0; a < 3; ++a) gradients[size_t(a)].corner[i] = g[a];
    }
    for (int a = 0; a < 3; ++a) {
        out.n[a] = gradients[size_t(a)].number(at.local);
        const Vec3d by_p = gradients[size_t(a)].gradient(at.local);
        for (int k = 0; k < 3; ++k) out.normal_by_p[k][a] = by_p[k];
    }
    if (out.n.dot(out.facet_n) > 0.0) return;
    out.n = out.facet_n;
    out.normal_by_p = Mat3d(0.0);
}

size_t LevelSet::bytes() const {
    return sizeof *this + bricks_.capacity() * sizeof(Brick);
}

double LevelSet::area(uint32_t index) const {
    return double(bricks_[index].mixed);
}

Vec3d LevelSet::point(uint32_t index, const Vec2d& u) const {
    // Along x through a cell that holds surface, from a place on its side
    const Brick& brick = bricks_[index];
    const double scaled = u.x * double(brick.mixed);
    uint32_t left = std::min(uint32_t(scaled), brick.mixed - 1);
    Vec3i at;
    for (at.z = brick.low.z; at.z < brick.high.z; ++at.z)
        for (at.y = brick.low.y; at.y < brick.high.y; ++at.y)
            for (at.x = brick.low.x; at.x < brick.high.x; ++at.x) {
                const LevelSetCell cell = cell_of(brick, at);
                if (!cell.is_mixed() || left-- > 0) continue;
                // Follow the slope to the surface; a few steps do
                Vec3d p(scaled - std::floor(scaled), u.y, 0.5);
                for (int i = 0; i < 4; ++i) {
                    const Vec3d g = cell.gradient(p);
                    const double slope2 = g.dot(g);
                    if (slope2 > 0.0) p -= g * (cell.number(p) / slope2);
                    for (int a = 0; a < 3; ++a) p[a] = std::clamp(p[a], 0.0, 1.0);
                }
                return to_double(at) + p;
            }
    return to_double(brick.low);
}

}  // namespace velatura::geometry
