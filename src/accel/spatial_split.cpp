// SPDX-License-Identifier: Apache-2.0
#include "accel/spatial_split.h"

#include <algorithm>
#include <array>

namespace velatura::accel {

namespace {

constexpr size_t bin_count = 16;

struct Bins {
    std::array<std::array<Bounds4, bin_count>, 3> box;
    std::array<std::array<uint32_t, bin_count>, 3> begin{}, end{};  // references that do so there

    void add(const Bins& other) {
        for (size_t axis = 0; axis < 3; ++axis) {
            for (size_t b = 0; b < bin_count; ++b) {
                box[axis][b].extend(other.box[axis][b]);
                begin[axis][b] += other.begin[axis][b];
                end[axis][b] += other.end[axis][b];
            }
        }
    }
};

// Slices of equal width.
class Slices {
  public:
    explicit Slices(const Bounds4& box) {
        for (int k = 0; k < 3; ++k) {
            const float extent = box.extent(k);
            origin_[k] = box.lower[k];
            width_[k] = extent / float(bin_count);
            const float scale = float(bin_count) / extent;
            scale_[k] = extent > 0 && scale < std::numeric_limits<float>::max() ? scale : 0.0f;
        }
    }

    bool is_flat(int axis) const { return scale_[axis] == 0.0f; }

    size_t slice(float x, int axis) const {
        const float s = (x - origin_[axis]) * scale_[axis];
        return size_t(std::clamp(int(s), 0, int(bin_count) - 1));
    }

    /// Where slice i begins.
    float plane(size_t i, int axis) const { return origin_[axis] + width_[axis] * float(i); }

  private:
    float origin_[3], width_[3], scale_[3];
};

void fill(std::span<const BuildPrim> references,
          const Slices& slices,
          const PrimClipper& clipper,
          Bins& bins) {
    for (const BuildPrim& reference : references) {
        for (int axis = 0; axis < 3; ++axis) {
            if (slices.is_flat(axis)) continue;
            const auto a = size_t(axis);
            const size_t first = slices.slice(reference.lower[axis], axis);
            const size_t last = slices.slice(reference.upper[axis], axis);
            ++bins.begin[a][first];
            ++bins.end[a][last];
            BuildPrim rest = reference;
            for (size_t i = first; i < last; ++i) {
                BuildPrim below, above;
                clipper.clip(rest, axis, slices.plane(i + 1, axis), below, above);
                bins.box[a][i].extend(lower_of(below), upper_of(below));
                rest = above;
            }
            bins.box[a][last].extend(lower_of(rest), upper_of(rest));
        }
    }
}

void find_on_axis(const Bins& bins, const Slices& slices, int axis, SpatialSplit& best) {
    const auto a = size_t(axis);
    std::array<Bounds4, bin_count> above;
    std::array<size_t, bin_count> above_count{};
    Bounds4 box;
    size_t count = 0;
    for (size_t i = bin_count - 1; i > 0; --i) {
        box.extend(bins.box[a][i]);
        count += bins.end[a][i];
        above[i] = box;
        above_count[i] = count;
    }
    box = {};
    count = 0;
    for (size_t i = 1; i < bin_count; ++i) {
        box.extend(bins.box[a][i - 1]);
        count += bins.begin[a][i - 1];
        if (count == 0 || above_count[i] == 0) continue;
        const double cost =
            box.half_area() * double(count) + above[i].half_area() * double(above_count[i]);
        if (cost >= best.cost) continue;
        best = {axis, slices.plane(i, axis), cost, box, above[i], count, above_count[i]};
    }
}

bool is_empty(const BuildPrim& p) {
    return !(p.lower[0] <= p.upper[0] && p.lower[1] <= p.upper[1] && p.lower[2] <= p.upper[2]);
}

Bounds4 joined(Bounds4 box, const BuildPrim& p) {
    box.extend(lower_of(p), upper_of(p));
    return box;
}

}  // namespace

SpatialSplit find_spatial_split(std::span<const BuildPrim> references,
                                const Bounds4& box,
                                const PrimClipper& clipper) {
    const Slices slices(box);
    const Bins bins = sum_up(
        references, Bins{},
        [&](std::span<const BuildPrim> some, Bins& part) { fill(some, slices, clipper, part); },
        [](Bins& sum, const Bins& part) { sum.add(part); });
    SpatialSplit best;
    for (int axis = 0; axis < 3; ++axis) {
        if (!slices.is_flat(axis)) find_on_axis(bins, slices, axis, best);
    }
    return best;
}

SpatialSides divide(std::span<const BuildPrim> references,
                    const SpatialSplit& split,
                    size_t budget,
                    const PrimClipper& clipper) {
    SpatialSides sides;
    sides.lower.reserve(split.lower_count);
    sides.upper.reserve(split.upper_count);
    const auto put_below = [&](const BuildPrim& p) {
        sides.lower.push_back(p);
        sides.lower_bounds.extend(p);
    };
    const auto put_above = [&](const BuildPrim& p) {
        sides.upper.push_back(p);
        sides.upper_bounds.extend(p);
    };
    const double area_below = split.lower.half_area(), area_above = split.upper.half_area();
    const auto n_below = double(split.lower_count), n_above = double(split.upper_count);
    for (const BuildPrim& p : references) {
        if (p.upper[split.axis] <= split.position) {
            put_below(p);
            continue;
        }
        if (p.lower[split.axis] >= split.position) {
            put_above(p);
            continue;
        }
        const double divided = area_below * n_below + area_above * n_above;
        const double all_below =
            joined(split.lower, p).half_area() * n_below + area_above * (n_above - 1);
        const double all_above =
            area_below * (n_below - 1) + joined(split.upper, p).half_area() * n_above;
        if (budget == 0 || std::min(all_below, all_above) <= divided) {
            all_below <= all_above ? put_below(p) : put_above(p);
            continue;
        }
        BuildPrim below, above;
        clipper.clip(p, split.axis, split.position, below, above);
        const bool has_below = !is_empty(below), has_above = !is_empty(above);
        if (has_below) put_below(below);
        if (has_above) put_above(above);
        if (has_below && has_above) --budget;
        if (!has_below && !has_above) put_below(p);
    }
    return sides;
}

}  // namespace velatura::accel
