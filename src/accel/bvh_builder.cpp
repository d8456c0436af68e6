// SPDX-License-Identifier: Apache-2.0
#include "accel/bvh_builder.h"

#include "base/tasks.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>

namespace velatura::accel {

namespace {

constexpr int max_bins = 32;
constexpr size_t parallel_split_count = 4096;  // smaller subtrees stay on one thread
constexpr size_t parallel_bin_count = 65536;   // larger ranges are binned in chunks
constexpr size_t bin_chunk = 16384;

// Four floats in one register; a vector extension that both compilers know.
using Vec4 = float __attribute__((vector_size(16)));

constexpr float inf = std::numeric_limits<float>::infinity();

// Both corners with one unused lane each.
struct Bounds4 {
    Vec4 lower = {inf, inf, inf, inf};
    Vec4 upper = {-inf, -inf, -inf, -inf};

    void extend(Vec4 low, Vec4 high) {
        lower = lower < low ? lower : low;
        upper = upper > high ? upper : high;
    }

    void extend(const Bounds4& b) { extend(b.lower, b.upper); }

    double half_area() const {
        const double x = double(upper[0]) - double(lower[0]);
        const double y = double(upper[1]) - double(lower[1]);
        const double z = double(upper[2]) - double(lower[2]);
        return x * y + y * z + z * x;
    }
};

// The fourth lane holds the bits of id or nothing; no one reads what comes of it.
Vec4 lower_of(const BuildPrim& p) {
    Vec4 v;
    std::memcpy(&v, p.lower, sizeof(v));
    return v;
}

Vec4 upper_of(const BuildPrim& p) {
    Vec4 v;
    std::memcpy(&v, p.upper, sizeof(v));
    return v;
}

float centroid(const BuildPrim& p, int axis) {
    return p.lower[axis] + p.upper[axis];
}

struct RangeBounds {
    Bounds4 box, centroids;  // centroids: sums of both corners

    void extend(const BuildPrim& p) {
        const Vec4 low = lower_of(p), high = upper_of(p);
        const Vec4 middle = low + high;
        box.extend(low, high);
        centroids.extend(middle, middle);
    }

    void extend(const RangeBounds& b) {
        box.extend(b.box);
        centroids.extend(b.centroids);
    }
};

struct Bins {
    std::array<std::array<Bounds4, max_bins>, 3> box;
    std::array<std::array<uint32_t, max_bins>, 3> count{};
};

struct Split {
    int axis = -1;
    int bin = 0;  // first bin of the right side
    double cost = std::numeric_limits<double>::infinity();
};

// Maps a centroid to its bin, the same for counting and partitioning.
struct BinMap {
    alignas(16) float origin[4];
    alignas(16) float scale[4];
    int bins = 0;

    BinMap(const Bounds4& centroids, int n) : bins(n) {
        for (int k = 0; k < 4; ++k) {
            const float extent = k < 3 ? centroids.upper[k] - centroids.lower[k] : 0.0f;
            origin[k] = k < 3 ? centroids.lower[k] : 0.0f;
            const float s = float(n) * (1.0f - 0x1p-20f) / extent;
            scale[k] = extent > 0 && s <= std::numeric_limits<float>::max() ? s : 0.0f;
        }
    }

    int bin(const BuildPrim& p, int axis) const {
        return std::min(bins - 1, int((centroid(p, axis) - origin[axis]) * scale[axis]));
    }
};

void fill_bins(std::span<const BuildPrim> prims, const BinMap& map, Bins& bins) {
    for (const BuildPrim& p : prims) {
        const Vec4 low = lower_of(p), high = upper_of(p);
        for (int axis = 0; axis < 3; ++axis) {
            const auto a = size_t(axis);
            const auto b = size_t(map.bin(p, axis));
            bins.box[a][b].extend(low, high);
            ++bins.count[a][b];
        }
    }
}

Split best_split(const Bins& bins, const BinMap& map) {
    Split best;
    const auto n = size_t(map.bins);
    for (size_t axis = 0; axis < 3; ++axis) {
        if (map.scale[axis] == 0.0f) continue;
        std::array<double, max_bins> right_cost{};
        Bounds4 box;
        size_t count = 0;
        for (size_t i = n - 1; i > 0; --i) {
            box.extend(bins.box[axis][i]);
            count += bins.count[axis][i];
            right_cost[i] = count > 0 ? box.half_area() * double(count) : -1.0;
        }
        box = {};
        count = 0;
        for (size_t i = 1; i < n; ++i) {
            box.extend(bins.box[axis][i - 1]);
            count += bins.count[axis][i - 1];
            if (count == 0 || right_cost[i] < 0) continue;
            const double cost = box.half_area() * double(count) + right_cost[i];
            if (cost < best.cost) best = {int(axis), int(i), cost};
        }
    }
    return best;
}

class Builder {
  public:
    Builder(std::span<BuildPrim> prims, const BinaryBuildOptions& options)
        : prims_(prims), options_(options), nodes_(prims.empty() ? 0 : 2 * prims.size() - 1) {}

    std::vector<BinaryNode> run() {
        if (!prims_.empty()) build(0, 0, prims_.size(), 0);
        return std::move(nodes_);
    }

  private:
    RangeBounds measure(std::span<const BuildPrim> range) const {
        RangeBounds bounds;
        if (range.size() < parallel_bin_count) {
            for (const BuildPrim& p : range) bounds.extend(p);
            return bounds;
        }
        std::vector<RangeBounds> parts((range.size() + bin_chunk - 1) / bin_chunk);
        parallel_for(parts.size(), [&](size_t i) {
            const size_t begin = i * bin_chunk;
            for (const BuildPrim& p :
                 range.subspan(begin, std::min(bin_chunk, range.size() - begin))) {
                parts[i].extend(p);
            }
        });
        for (const RangeBounds& part : parts) bounds.extend(part);
        return bounds;
    }

    // Unions and counts do not depend on the order, so neither does the tree.
    void count_bins(std::span<const BuildPrim> range, const BinMap& map, Bins& bins) const {
        if (range.size() < parallel_bin_count) return fill_bins(range, map, bins);
        std::vector<Bins> parts((range.size() + bin_chunk - 1) / bin_chunk);
        parallel_for(parts.size(), [&](size_t i) {
            const size_t begin = i * bin_chunk;
            fill_bins(range.subspan(begin, std::min(bin_chunk, range.size() - begin)), map,
                      parts[i]);
        });
        for (const Bins& part : parts) {
            for (size_t axis = 0; axis < 3; ++axis) {
                for (size_t b = 0; b < size_t(map.bins); ++b) {
                    bins.box[axis][b].extend(part.box[axis][b]);
                    bins.count[axis][b] += part.count[axis][b];
                }
            }
        }
    }

    // Moves the left side to the front; returns its size.
    size_t split_range(std::span<BuildPrim> range, const RangeBounds& bounds, int depth) const {
        const Bounds4& c = bounds.centroids;
        int widest = 0;
        for (int k = 1; k < 3; ++k) {
            if (c.upper[k] - c.lower[k] > c.upper[widest] - c.lower[widest]) widest = k;
        }
        if (depth < options_.max_depth && c.upper[widest] > c.lower[widest]) {
            // Few primitives need few candidate planes
            const int bins_here =
                std::min(options_.bins, int(std::min<size_t>(range.size(), 28)) + 4);
            const BinMap map(c, std::clamp(bins_here, 2, max_bins));
            Bins bins;
            count_bins(range, map, bins);
            const Split split = best_split(bins, map);
            if (split.axis >= 0) {
                const auto middle = std::partition(
                    range.begin(), range.end(),
                    [&](const BuildPrim& p) { return map.bin(p, split.axis) < split.bin; });
                return size_t(middle - range.begin());
            }
        }
        // Halve by centroid, then by index: total order, so the outcome is unique
        const auto middle = range.begin() + std::ptrdiff_t(range.size() / 2);
        std::nth_element(range.begin(), middle, range.end(),
                         [&](const BuildPrim& a, const BuildPrim& b) {
                             const float ca = centroid(a, widest), cb = centroid(b, widest);
                             return ca != cb ? ca < cb : a.id < b.id;
                         });
        return range.size() / 2;
    }

    void build(size_t at, size_t first, size_t count, int depth) {
        BinaryNode& node = nodes_[at];
        std::span<BuildPrim> range = prims_.subspan(first, count);
        const RangeBounds bounds = measure(range);
        const Bounds4& c = bounds.centroids;
        const bool is_point =
            c.lower[0] == c.upper[0] && c.lower[1] == c.upper[1] && c.lower[2] == c.upper[2];
        if (is_point && count > 8 && options_.merge_duplicates) {
            count = options_.merge_duplicates(range);
            range = prims_.subspan(first, count);
        }
        for (int k = 0; k < 3; ++k) {
            node.lower[k] = bounds.box.lower[k];
            node.upper[k] = bounds.box.upper[k];
        }
        node.first = uint32_t(first);
        node.count = uint32_t(count);
        if (count == 1) return;
        const size_t left = split_range(range, bounds, depth);
        // The left subtree fills exactly 2·left − 1 slots
        node.right = uint32_t(at + 2 * left);
        const auto child = [&](size_t side) {
            if (side == 0) {
                build(at + 1, first, left, depth + 1);
            } else {
                build(at + 2 * left, first + left, count - left, depth + 1);
            }
        };
        if (count >= parallel_split_count) {
            parallel_for(2, child);
        } else {
            child(0);
            child(1);
        }
    }

    std::span<BuildPrim> prims_;
    const BinaryBuildOptions& options_;
    std::vector<BinaryNode> nodes_;
};

}  // namespace

std::vector<BinaryNode> build_binary_tree(std::span<BuildPrim> prims,
                                          const BinaryBuildOptions& options) {
    return Builder(prims, options).run();
}

}  // namespace velatura::accel
