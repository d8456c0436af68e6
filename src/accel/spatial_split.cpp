// SPDX-License-Identifier: Apache-2.0
#include "accel/spatial_split.h"

#include "accel/ray_query.h"

#include <algorithm>
#include <array>
#include <utility>

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

Bounds4 box_of(const BuildPrim& p) {
    return {lower_of(p), upper_of(p)};
}

template <class Box>
bool is_empty(const Box& b) {
    return !(b.lower[0] <= b.upper[0] && b.lower[1] <= b.upper[1] && b.lower[2] <= b.upper[2]);
}

// Extends the boxes of slices by the part of the edge from a to b that the reference covers.
void walk_edge(Vec4 a, Vec4 b, const BuildPrim& p, const Slices& slices, int axis, Bounds4* parts) {
    if (a[axis] > b[axis]) std::swap(a, b);
    const float begin = std::max(a[axis], p.lower[axis]), end = std::min(b[axis], p.upper[axis]);
    if (begin > end) return;
    const float length = b[axis] - a[axis];
    const Vec4 step = length > 0 ? (b - a) * (1.0f / length) : Vec4{};
    const auto at = [&](float x) { return a + step * (x - a[axis]); };
    size_t i = slices.slice(begin, axis);
    const size_t last = slices.slice(end, axis);
    const Vec4 first_point = begin > a[axis] ? at(begin) : a;
    parts[i].extend(first_point, first_point);
    for (; i < last; ++i) {
        const Vec4 crossing = at(slices.plane(i + 1, axis));
        parts[i].extend(crossing, crossing);
        parts[i + 1].extend(crossing, crossing);
    }
    const Vec4 last_point = end < b[axis] ? at(end) : b;
    parts[last].extend(last_point, last_point);
}

// What lies in each slice; rounding does not matter here.
void chop(const TriangleCorners4& corners,
          const BuildPrim& p,
          const Slices& slices,
          int axis,
          size_t first,
          size_t last,
          std::array<Bounds4, bin_count>& bins) {
    Bounds4 parts[bin_count];
    for (int i = 0; i < 3; ++i)
        walk_edge(corners.p[i], corners.p[i == 2 ? 0 : i + 1], p, slices, axis, parts);
    const Bounds4 own = box_of(p);
    for (size_t i = first; i <= last; ++i) {
        const Bounds4 part = intersection(parts[i], own);
        if (!is_empty(part)) bins[i].extend(part);
    }
}

void fill(std::span<const BuildPrim> references,
          const Slices& slices,
          const TriangleSource& source,
          Bins& bins) {
    for (const BuildPrim& p : references) {
        TriangleCorners4 corners;
        bool is_known = false;
        for (int axis = 0; axis < 3; ++axis) {
            if (slices.is_flat(axis)) continue;
            const auto a = size_t(axis);
            size_t first = slices.slice(p.lower[axis], axis);
            size_t last = slices.slice(p.upper[axis], axis);
            if (!p.is_divisible && first != last)
                first = last = slices.slice(0.5f * centroid(p, axis), axis);
            ++bins.begin[a][first];
            ++bins.end[a][last];
            if (first == last) {
                bins.box[a][first].extend(lower_of(p), upper_of(p));
                continue;
            }
            if (!is_known) corners = source.corners(p.id);
            is_known = true;
            chop(corners, p, slices, axis, first, last, bins.box[a]);
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

// What split_margin asks for and the rounding of the crossing points.
float margin_of(const Bounds4& box) {
    float edge = 0, reach = 0;
    for (int k = 0; k < 3; ++k) {
        edge = std::max(edge, box.extent(k));
        reach = std::max(reach, std::max(-box.lower[k], box.upper[k]));
    }
    return split_margin * edge + 0x1p-20f * reach;
}

BuildPrim part_of(const BuildPrim& reference, const Bounds4& box, float margin) {
    BuildPrim part = reference;
    for (int k = 0; k < 3; ++k) {
        part.lower[k] = std::max(reference.lower[k], box.lower[k] - margin);
        part.upper[k] = std::min(reference.upper[k], box.upper[k] + margin);
    }
    return part;
}

// What a reference stands for below and above a plane.
std::pair<BuildPrim, BuildPrim> clip(const BuildPrim& reference,
                                     const TriangleCorners4& corners,
                                     int axis,
                                     float position) {
    Bounds4 all, low, high;
    for (int i = 0; i < 3; ++i) {
        const Vec4 &a = corners.p[i], &b = corners.p[i == 2 ? 0 : i + 1];
        all.extend(a, a);
        if (a[axis] <= position) low.extend(a, a);
        if (a[axis] >= position) high.extend(a, a);
        if ((a[axis] < position) == (b[axis] < position)) continue;
        const double t = (double(position) - double(a[axis])) / (double(b[axis]) - double(a[axis]));
        const Vec4 crossing = a + (b - a) * float(t);
        low.extend(crossing, crossing);
        high.extend(crossing, crossing);
    }
    const float margin = margin_of(all);
    return {part_of(reference, low, margin), part_of(reference, high, margin)};
}

Bounds4 joined(Bounds4 box, const BuildPrim& p) {
    box.extend(lower_of(p), upper_of(p));
    return box;
}

// Says for references across a plane where they go.
class Sorter {
  public:
    explicit Sorter(const SpatialSplit& split)
        : split_(split),
          area_below_(split.lower.half_area()),
          area_above_(split.upper.half_area()),
          n_below_(double(split.lower_count)),
          n_above_(double(split.upper_count)),
          divided_(area_below_ * n_below_ + area_above_ * n_above_) {}

    // Whether it costs less to leave the reference whole and on which side.
    bool is_better_whole(const BuildPrim& p, bool& is_above) const {
        const double below =
            joined(split_.lower, p).half_area() * n_below_ + area_above_ * (n_above_ - 1);
        const double above =
            area_below_ * (n_below_ - 1) + joined(split_.upper, p).half_area() * n_above_;
        is_above = above < below;
        return std::min(below, above) <= divided_;
    }

  private:
    const SpatialSplit& split_;
    double area_below_, area_above_, n_below_, n_above_, divided_;
};

}  // namespace

SpatialSplit find_spatial_split(std::span<const BuildPrim> references,
                                const Bounds4& box,
                                const TriangleSource& source) {
    const Slices slices(box);
    const Bins bins = sum_up(
        references, Bins{},
        [&](std::span<const BuildPrim> some, Bins& part) { fill(some, slices, source, part); },
        [](Bins& sum, const Bins& part) { sum.add(part); });
    SpatialSplit best;
    for (int axis = 0; axis < 3; ++axis) {
        if (!slices.is_flat(axis)) find_on_axis(bins, slices, axis, best);
    }
    return best;
}

SpatialSides divide(std::span<BuildPrim> references_and_room,
                    size_t count,
                    const SpatialSplit& split,
                    const TriangleSource& source) {
    const std::span<BuildPrim> all = references_and_room;
    const Sorter sorter(split);
    size_t end = count;
    for (size_t i = 0; i < count; ++i) {
        BuildPrim& p = all[i];
        p.is_above = p.lower[split.axis] >= split.position;
        if (p.is_above || p.upper[split.axis] <= split.position) continue;
        if (!p.is_divisible) {
            p.is_above = 0.5f * centroid(p, split.axis) >= split.position;
            continue;
        }
        bool is_above = false;
        const bool stays_whole = sorter.is_better_whole(p, is_above);
        p.is_above = is_above;
        if (stays_whole || end == all.size()) continue;
        const auto [below, above] = clip(p, source.corners(p.id), split.axis, split.position);
        const bool has_below = !is_empty(below), has_above = !is_empty(above);
        if (has_below && has_above) {
            p = below;
            p.is_above = false;
            all[end] = above;
            all[end++].is_above = true;
        } else if (has_below || has_above) {
            p = has_below ? below : above;
            p.is_above = has_above;
        }
    }
    SpatialSides sides;
    for (size_t i = 0; i < end; ++i) {
        const BuildPrim p = all[i];
        (p.is_above ? sides.upper : sides.lower).extend(p);
        all[i] = all[sides.lower_count];
        all[sides.lower_count] = p;
        sides.lower_count += !p.is_above;
    }
    sides.upper_count = end - sides.lower_count;
    return sides;
}

}  // namespace velatura::accel
