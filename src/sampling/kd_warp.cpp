// SPDX-License-Identifier: Apache-2.0
#include "sampling/kd_warp.h"

#include <algorithm>
#include <cmath>

namespace velatura::sampling {

namespace {

constexpr double uniform_share = 0.25;
constexpr int bin_count = 8;  // along an axis of a cell; cuts lie between them
constexpr size_t min_samples = 32;
constexpr int max_depth = 24;
/// Share of a cell's cost that a cut must save.
constexpr double min_gain = 0.02;

/// What a part of the cube adds to the standard deviation of the estimate if its density is the
/// best one: volume × √(mean square), where Σ square / density is samples × volume × mean square.
double cost_of(double squares, double volume) {
    return std::sqrt(squares * volume);
}

using Halves = std::array<double, 2>;

}  // namespace

/// Cuts cells, depth first.
class KdWarp::Builder {
  public:
    explicit Builder(std::span<const Sample> samples) : samples_(samples), order_(samples.size()) {
        for (size_t i = 0; i < order_.size(); ++i) order_[i] = uint32_t(i);
    }

    std::vector<Node> build() {
        Cell cube;
        cube.end = order_.size();
        cube.high.fill(1.0);
        add_node(cube);
        cut(0, cube, 0);
        if (!(costs_[0] > 0.0)) return {{}};
        for (Node& node : nodes_)
            if (node.children != 0) {
                const double below = chance(node.children), above = chance(node.children + 1);
                node.below = below / (below + above);
            }
        return std::move(nodes_);
    }

  private:
    struct Cell {
        size_t begin = 0, end = 0;  // of order_
        Point low{}, high{};
        double volume = 1;
    };

    struct Cut {
        size_t axis = dimension_count;
        double at = 0;
        double part = 0;  // of the cell, below
        double gain = min_gain;
    };

    /// Of samples that were drawn by any density, as if they were uniform.
    double square(uint32_t i) const { return samples_[i].square / samples_[i].density; }

    double chance(uint32_t node) const {
        return (1.0 - uniform_share) * costs_[node] / costs_[0] + uniform_share * volumes_[node];
    }

    void add_node(const Cell& cell) {
        nodes_.push_back({});
        volumes_.push_back(cell.volume);
        double squares = 0;
        for (size_t k = cell.begin; k < cell.end; ++k) squares += square(order_[k]);
        costs_.push_back(cost_of(squares, cell.volume));
    }

    /// Replaces `best` if a cut along the axis gains more in the even half, and half of the least
    /// in the odd one.
    void try_axis(const Cell& cell, size_t axis, Cut& best) const {
        const double low = cell.low[axis], width = cell.high[axis] - low;
        if (!(width > 1e-6)) return;
        std::array<Halves, bin_count> squares{};
        std::array<size_t, bin_count> counts{};
        for (size_t k = cell.begin; k < cell.end; ++k) {
            const uint32_t i = order_[k];
            const double x = (samples_[i].u[axis] - low) / width * bin_count;
            const size_t bin = size_t(std::clamp(x, 0.0, double(bin_count - 1)));
            squares[bin][i & 1] += square(i);
            ++counts[bin];
        }
        Halves all{}, below{};
        for (const Halves& bin : squares)
            for (size_t half = 0; half < 2; ++half) all[half] += bin[half];
        size_t count_below = 0;
        for (size_t b = 0; b + 1 < bin_count; ++b) {
            for (size_t half = 0; half < 2; ++half) below[half] += squares[b][half];
            count_below += counts[b];
            if (std::min(count_below, cell.end - cell.begin - count_below) < min_samples) continue;
            const double part = double(b + 1) / bin_count;
            const auto gain = [&](size_t half) {
                const double above = std::max(0.0, all[half] - below[half]);
                return 1.0 - (cost_of(below[half], part) + cost_of(above, 1.0 - part)) /
                                 cost_of(all[half], 1.0);
            };
            if (all[0] > 0.0 && all[1] > 0.0 && gain(0) > best.gain && gain(1) > 0.5 * min_gain)
                best = {axis, low + width * part, part, gain(0)};
        }
    }

    void cut(uint32_t node, const Cell& cell, int depth) {
        Cut best;
        if (depth < max_depth && cell.end - cell.begin >= 2 * min_samples)
            for (size_t axis = 0; axis < dimension_count; ++axis) try_axis(cell, axis, best);
        if (best.axis == dimension_count) return;

        const auto begin = order_.begin();
        const auto middle =
            std::partition(begin + ptrdiff_t(cell.begin), begin + ptrdiff_t(cell.end),
                           [&](uint32_t i) { return samples_[i].u[best.axis] < best.at; });
        Cell below = cell, above = cell;
        below.end = above.begin = size_t(middle - begin);
        below.high[best.axis] = above.low[best.axis] = best.at;
        below.volume *= best.part;
        above.volume *= 1.0 - best.part;
        const uint32_t children = uint32_t(nodes_.size());
        nodes_[node] = {children, uint8_t(best.axis), best.at, 0.0};
        add_node(below);
        add_node(above);
        cut(children, below, depth + 1);
        cut(children + 1, above, depth + 1);
        costs_[node] = costs_[children] + costs_[children + 1];
    }

    std::span<const Sample> samples_;
    std::vector<uint32_t> order_;
    std::vector<Node> nodes_;
    std::vector<double> costs_, volumes_;  // [node]
};

KdWarp::KdWarp(std::span<const Sample> samples) : nodes_(Builder(samples).build()) {}

double KdWarp::warp(Point& u) const {
    Point low{}, high;
    high.fill(1.0);
    double density = 1;
    uint32_t n = 0;
    while (nodes_[n].children != 0) {
        const Node& node = nodes_[n];
        const size_t axis = node.axis;
        const double part = (node.cut - low[axis]) / (high[axis] - low[axis]);
        if (u[axis] < node.below) {
            u[axis] /= node.below;
            density *= node.below / part;
            high[axis] = node.cut;
            n = node.children;
        } else {
            u[axis] = (u[axis] - node.below) / (1.0 - node.below);
            density *= (1.0 - node.below) / (1.0 - part);
            low[axis] = node.cut;
            n = node.children + 1;
        }
    }
    for (size_t axis = 0; axis < dimension_count; ++axis)
        u[axis] = std::clamp(low[axis] + u[axis] * (high[axis] - low[axis]), low[axis],
                             std::nextafter(high[axis], 0.0));
    return density;
}

double KdWarp::density(const Point& u) const {
    Point low{}, high;
    high.fill(1.0);
    double density = 1;
    uint32_t n = 0;
    while (nodes_[n].children != 0) {
        const Node& node = nodes_[n];
        const double part = (node.cut - low[node.axis]) / (high[node.axis] - low[node.axis]);
        const bool is_below = u[node.axis] < node.cut;
        density *= is_below ? node.below / part : (1.0 - node.below) / (1.0 - part);
        (is_below ? high : low)[node.axis] = node.cut;
        n = node.children + (is_below ? 0 : 1);
    }
    return density;
}

}  // namespace velatura::sampling
