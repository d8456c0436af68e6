// SPDX-License-Identifier: Apache-2.0
#include "accel/placement.h"

#include "accel/build_prim.h"
#include "accel/ray_query.h"
#include "geometry/motion.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace velatura::accel {

namespace {

// Inverse by cofactors; false when there is none.
bool invert(const Mat4& m, InstanceRecord& record) {
    const Mat4d forward(m);
    const double det = determinant3(forward);
    if (!(std::abs(det) > 0)) return false;
    const Mat3d cofactors = cofactor_matrix(forward);
    for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) record.prototype_from_render[i][k] = cofactors[k][i] / det;
    }
    for (int k = 0; k < 3; ++k) {
        double t = 0;
        for (int i = 0; i < 3; ++i) t -= forward[3][i] * record.prototype_from_render[i][k];
        record.prototype_from_render[3][k] = t;
    }
    for (const auto& row : record.prototype_from_render) {
        for (const double entry : row) {
            if (!std::isfinite(entry)) return false;
        }
    }
    return true;
}

}  // namespace

std::vector<Box3> outline(const WideTree& tree, size_t max_value) {
    if (tree.is_empty()) return {};

    struct Part {
        Box3 box;
        ChildRef ref;
        double area;
    };

    const auto is_smaller = [](const Part& a, const Part& b) { return a.area < b.area; };
    std::vector<Part> open = {{tree.bounds, 0, 0}};  // a heap
    std::vector<Box3> boxes;
    while (!open.empty()) {
        std::pop_heap(open.begin(), open.end(), is_smaller);
        const Part part = open.back();
        open.pop_back();
        if ((part.ref & leaf_bit) != 0 || boxes.size() + open.size() >= max_value) {
            boxes.push_back(part.box);
            continue;
        }
        const WideNode& node = tree.nodes[part.ref];
        for (size_t i = 0; i < wide; ++i) {
            if (!(node.bounds[0][i] <= node.bounds[3][i])) continue;  // unused
            const Box3 box(Vec3(node.bounds[0][i], node.bounds[1][i], node.bounds[2][i]),
                           Vec3(node.bounds[3][i], node.bounds[4][i], node.bounds[5][i]));
            open.push_back({box, node.child[i], half_area(box.min, box.max)});
            std::push_heap(open.begin(), open.end(), is_smaller);
        }
    }
    return boxes;
}

namespace {

// Growth of rounding errors on the way into the prototype and back.
double condition_of(const Mat4& m, const InstanceRecord& record) {
    double condition = 0;
    for (int i = 0; i < 3; ++i) {
        double row = 0;
        for (int j = 0; j < 3; ++j) {
            for (int k = 0; k < 3; ++k)
                row += std::abs(record.prototype_from_render[i][j] * double(m[j][k]));
        }
        condition = std::max(condition, row);
    }
    return condition;
}

// The box of the mapped boxes. Returns: the largest summand of a mapped coordinate, or more.
double map_boxes(const Mat4& m, std::span<const Box3> boxes, Vec3d& low, Vec3d& high) {
    double largest = 0;
    for (int k = 0; k < 3; ++k) {
        const Vec3d column(double(m[0][k]), double(m[1][k]), double(m[2][k]));
        const Vec3d size(std::abs(column.x), std::abs(column.y), std::abs(column.z));
        double lower = std::numeric_limits<double>::max(), upper = -lower, magnitude = 0;
        for (const Box3& box : boxes) {
            const Vec3d min(box.min), max(box.max), center = (min + max) * 0.5,
                                                    half = (max - min) * 0.5;
            const double middle = center.dot(column), reach = half.dot(size);
            lower = std::min(lower, middle - reach);
            upper = std::max(upper, middle + reach);
            magnitude =
                std::max(magnitude, std::abs(center.x * column.x) + std::abs(center.y * column.y) +
                                        std::abs(center.z * column.z) + reach);
        }
        low[k] = lower + double(m[3][k]);
        high[k] = upper + double(m[3][k]);
        largest = std::max(largest, magnitude + std::abs(double(m[3][k])));
    }
    return largest;
}

// False when it becomes too large.
bool grow(double pad, Vec3d& lower, Vec3d& upper) {
    for (int k = 0; k < 3; ++k) {
        lower[k] -= pad;
        upper[k] += pad;
        if (!(std::abs(lower[k]) < double(coordinate_limit))) return false;
        if (!(std::abs(upper[k]) < double(coordinate_limit))) return false;
    }
    return true;
}

}  // namespace

bool place(const Mat4& m, std::span<const Box3> boxes, PlacedBox& placed) {
    if (!is_finite(m, coordinate_limit) || !invert(m, placed.record)) return false;
    placed.condition = condition_of(m, placed.record);
    const double largest = map_boxes(m, boxes, placed.lower, placed.upper);
    // Grow by the error of mapping there and back
    return grow(0x1p-46 * placed.condition * largest, placed.lower, placed.upper);
}

bool place_keys(std::span<const Mat4> keys,
                std::span<const Box3> boxes,
                std::vector<Box3d>& placed) {
    placed.resize(keys.size());
    std::vector<double> largest(keys.size());
    for (size_t k = 0; k < keys.size(); ++k) {
        if (!is_finite(keys[k], coordinate_limit)) return false;
        largest[k] = map_boxes(keys[k], boxes, placed[k].min, placed[k].max);
    }
    for (size_t k = 0; k < keys.size(); ++k) {
        // Entries between two keys are rounded to floats, by what they are at either, which outdoes
        // the error of the way back
        const size_t first = k == 0 ? 0 : k - 1, last = std::min(k + 1, keys.size() - 1);
        const double max_value = std::max({largest[first], largest[k], largest[last]});
        if (!grow(0x1p-20 * max_value, placed[k].min, placed[k].max)) return false;
    }
    return true;
}

bool place_at_time(std::span<const Mat4> keys, float time, InstanceRecord& record) {
    const geometry::MotionTime at = geometry::motion_time(time, uint32_t(keys.size() - 1));
    const Mat4 m = geometry::moved(keys[at.segment], keys[at.segment + 1], at.f);
    // Written so that NaN is not placed
    return invert(m, record) && condition_of(m, record) <= worst_moving_condition;
}

void enter(const InstanceRecord& instance, const geometry::Ray& ray, Vec3d& o, Vec3d& d) {
    const auto& m = instance.prototype_from_render;
    for (int k = 0; k < 3; ++k) {
        d[k] = double(ray.d.x) * m[0][k] + double(ray.d.y) * m[1][k] + double(ray.d.z) * m[2][k];
        o[k] = double(ray.o.x) * m[0][k] + double(ray.o.y) * m[1][k] + double(ray.o.z) * m[2][k] +
               m[3][k];
    }
}

bool round_outward(const Box3d& box, Box3& out) {
    for (int k = 0; k < 3; ++k) {
        // Written so that NaN does not fit
        if (!(box.min[k] <= box.max[k])) return false;
        if (!(box.min[k] > -double(coordinate_limit) && box.max[k] < double(coordinate_limit)))
            return false;
        out.min[k] = next_float_down(float(box.min[k]));
        out.max[k] = next_float_up(float(box.max[k]));
    }
    return true;
}

}  // namespace velatura::accel
