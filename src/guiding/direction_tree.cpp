// SPDX-License-Identifier: Apache-2.0
#include "guiding/direction_tree.h"

#include "guiding/equal_area.h"
#include "sampling/warp.h"

#include <algorithm>
#include <array>

namespace velatura::guiding {

namespace {

constexpr float below_one = 0x1.fffffep-1f;

/// A quarter becomes a node of its own when it holds this share of the whole …
constexpr double min_share = 0.003;
/// … and this many items of like weight at least; finer cells would follow noise.
constexpr double min_items = 4;
/// Smallest cell: 4^-9 of the sphere, 0.4° wide.
constexpr int depth_limit = 9;
/// Items that the assumption of equality is worth (Dirichlet prior).
constexpr double prior_items = 8;

int quarter_of(const Vec2& q) {
    return (q.x >= 0.5f ? 1 : 0) + (q.y >= 0.5f ? 2 : 0);
}

/// The quarter's own square: exact in floating point.
Vec2 zoom(const Vec2& q, int quarter) {
    return {2.0f * q.x - float(quarter & 1), 2.0f * q.y - float(quarter >> 1)};
}

struct Mass {
    double sum = 0, squares = 0;

    void add(float weight) {
        sum += double(weight);
        squares += double(weight) * double(weight);
    }

    /// Items of equal weight that would say as much (Kish 1965).
    double effective_items() const { return squares > 0 ? sum * sum / squares : 0; }
};

class Fitter {
  public:
    std::vector<DirectionNode> fit(std::span<WeightedDirection> items) {
        Mass all;
        for (const WeightedDirection& item : items) all.add(item.weight);
        if (all.sum > 0) divide(items, all, 1.0, 0);
        return std::move(nodes_);
    }

  private:
    uint32_t divide(std::span<WeightedDirection> items, const Mass& all, double share, int depth) {
        const uint32_t index = uint32_t(nodes_.size());
        nodes_.emplace_back();
        const std::array<std::span<WeightedDirection>, 4> quarters = partition(items);
        const double items_here = all.effective_items();
        std::array<uint32_t, 4> child{};
        for (size_t k = 0; k < 4; ++k) {
            Mass mass;
            for (WeightedDirection& item : quarters[k]) {
                item.q = zoom(item.q, int(k));
                mass.add(item.weight);
            }
            const double part =
                (items_here * mass.sum / all.sum + prior_items / 4) / (items_here + prior_items);
            nodes_[index].share[k] = float(part);
            const bool is_worth = share * part >= min_share && depth + 1 < depth_limit &&
                                  mass.effective_items() >= min_items;
            if (is_worth) child[k] = divide(quarters[k], mass, share * part, depth + 1);
        }
        std::copy(child.begin(), child.end(), nodes_[index].child);
        return index;
    }

    /// Sorts the items by quarter, keeping their order within each: sums do not depend on how a
    /// library sorts.
    std::array<std::span<WeightedDirection>, 4> partition(std::span<WeightedDirection> items) {
        std::array<size_t, 5> start{};
        for (const WeightedDirection& item : items) ++start[size_t(quarter_of(item.q)) + 1];
        for (size_t k = 0; k < 4; ++k) start[k + 1] += start[k];
        std::array<size_t, 4> next{start[0], start[1], start[2], start[3]};
        scratch_.assign(items.begin(), items.end());
        for (const WeightedDirection& item : scratch_) {
            items[next[size_t(quarter_of(item.q))]++] = item;
        }
        std::array<std::span<WeightedDirection>, 4> out;
        for (size_t k = 0; k < 4; ++k) out[k] = items.subspan(start[k], start[k + 1] - start[k]);
        return out;
    }

    std::vector<DirectionNode> nodes_;
    std::vector<WeightedDirection> scratch_;
};

}  // namespace

std::vector<DirectionNode> fit_direction_tree(std::span<WeightedDirection> items) {
    return Fitter().fit(items);
}

DirectionSample DirectionTree::sample(Vec2 u) const {
    const DirectionNode* node = root_;
    Vec2 corner(0.0f);
    float width = 1.0f, density = sampling::inv_4pi;
    while (true) {
        // Choose the column, then the quarter in it; what is left of u is uniform again
        const float left = node->share[0] + node->share[2];
        const int right = u.x < left ? 0 : 1;
        u.x = std::min(right ? (u.x - left) / (1.0f - left) : u.x / left, below_one);
        const float lower = node->share[right] / (node->share[right] + node->share[right + 2]);
        const int upper = u.y < lower ? 0 : 1;
        u.y = std::min(upper ? (u.y - lower) / (1.0f - lower) : u.y / lower, below_one);

        const int quarter = right + 2 * upper;
        width *= 0.5f;
        corner += Vec2(float(right), float(upper)) * width;
        density *= 4.0f * node->share[quarter];
        if (node->child[quarter] == 0) break;
        node = root_ + node->child[quarter];
    }
    return {direction_from_square(corner + u * width), density};
}

float DirectionTree::pdf(const Vec3& wi) const {
    const DirectionNode* node = root_;
    Vec2 q = square_from_direction(wi);
    float density = sampling::inv_4pi;
    while (true) {
        const int quarter = quarter_of(q);
        density *= 4.0f * node->share[quarter];
        if (node->child[quarter] == 0) return density;
        q = zoom(q, quarter);
        node = root_ + node->child[quarter];
    }
}

}  // namespace velatura::guiding
