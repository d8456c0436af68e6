// SPDX-License-Identifier: Apache-2.0
#include "translate/instancing/placement_motion.h"

#include "translate/context/instance_source.h"
#include "translate/context/values.h"
#include "translate/motion/scoped_time.h"
#include "translate/motion/shutter.h"
#include "translate/motion/unblurred.h"
#include "usd/stage/xform.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>
#include <optional>
#include <variant>

namespace velatura::translate::instancing {

bool must_stay(const Context& ctx, InstanceSource& what) {
    if (what.must_stay) return *what.must_stay;
    const auto emits = [&](scene::MaterialId material) {
        return material < ctx.scene.materials.size() &&
               scene::is_emissive(ctx.scene.materials[material]);
    };
    const auto is_light = [&](const scene::Shape& shape) {
        const auto* mesh = std::get_if<scene::Mesh>(&shape.geometry);
        return shape.light != scene::none || emits(shape.material) ||
               (mesh &&
                std::any_of(mesh->face_materials.begin(), mesh->face_materials.end(), emits));
    };
    what.must_stay =
        !what.lights.empty() || !what.volumes.empty() ||
        std::any_of(what.shapes.begin(), what.shapes.end(), is_light) ||
        std::any_of(what.placements.begin(), what.placements.end(),
                    [&](const Placement& inner) { return must_stay(ctx, *inner.what); });
    return *what.must_stay;
}

namespace {

/// Largest sum of a row of the upper 3×3: what the matrix may lengthen.
double largest_row(const Mat4d& m) {
    double max = 0;
    for (int i = 0; i < 3; ++i)
        max = std::max(max, std::abs(m[i][0]) + std::abs(m[i][1]) + std::abs(m[i][2]));
    return max;
}

double translation(const Mat4d& m) {
    return Vec3d(m[3][0], m[3][1], m[3][2]).length();
}

double furthest(const std::vector<Vec3>& points) {
    double reach = 0;
    for (const Vec3& p : points)
        if (is_finite(p)) reach = std::max(reach, Vec3d(p).length());
    return reach;
}

/// Of curves or balls, with the widest of them.
template <class Round>
double furthest(const Round& round) {
    float widest = 0;
    for (const float width : round.widths) widest = std::max(widest, width);
    return furthest(round.points) + 0.5 * double(widest);
}

double reach_of(double size, const Mat4d& placed) {
    return size * largest_row(placed) + translation(placed);
}

}  // namespace

double reach_of(InstanceSource& what) {
    if (what.reach) return *what.reach;
    double reach = 0;
    for (const scene::Shape& shape : what.shapes) {
        if (const auto* mesh = std::get_if<scene::Mesh>(&shape.geometry)) {
            reach = std::max(reach, furthest(mesh->points));
        } else if (const auto* gprim = std::get_if<scene::Gprim>(&shape.geometry)) {
            const double size =
                std::max({gprim->radius, gprim->height, gprim->size, gprim->width, gprim->length});
            reach = std::max(reach, reach_of(size, gprim->shape_from_gprim));
        } else if (const auto* curves = std::get_if<scene::Curves>(&shape.geometry)) {
            reach = std::max(reach, reach_of(furthest(*curves), curves->shape_from_curves));
        } else if (const auto* cloud = std::get_if<scene::Points>(&shape.geometry)) {
            reach = std::max(reach, reach_of(furthest(*cloud), cloud->shape_from_points));
        }
    }
    for (const Placement& inner : what.placements)
        reach = std::max(
            reach, reach_of(*inner.what) * largest_row(inner.matrix) + translation(inner.matrix));
    what.reach = reach;
    return reach;
}

bool strays(const Mat4d& m, const Mat4d& straight, double reach) {
    const Mat4d off = m - straight;
    return largest_row(off) * reach + translation(off) >
           motion::interpolation_tolerance * reach * largest_row(m);
}

bool fits_floats(const Mat4d& m) {
    return is_finite(Mat4d(to_float(m)));
}

size_t fewest_segments(std::vector<double> times, Prim prim, Prim frame, const Shutter& shutter) {
    for (const Prim at : motion::chain_of(prim, frame)) {
        const auto more = usd::stage::transform_sample_times(at);
        times.insert(times.end(), more.begin(), more.end());
    }
    std::erase_if(times, [&](double t) { return !(t > shutter.open && t < shutter.close); });
    std::sort(times.begin(), times.end());
    const auto turns = std::unique(times.begin(), times.end()) - times.begin();
    return std::min(std::bit_ceil(size_t(turns) + 1), motion::max_segments);
}

Mat4d between(const Mat4d& a, const Mat4d& b, double f) {
    return a * (1 - f) + b * f;
}

namespace {

/// Key k of `count` + 1; count is a multiple of the segments that there are.
Mat4d key_of(const Mat4d& first, const std::vector<Mat4d>& later, size_t key, size_t count) {
    if (later.empty()) return first;
    const size_t step = count / later.size(), segment = std::min(key / step, later.size() - 1);
    const Mat4d& from = segment == 0 ? first : later[segment - 1];
    return between(from, later[segment], double(key - segment * step) / double(step));
}

}  // namespace

void read_placement_motion(Context& ctx,
                           Prim instance,
                           const InstanceSource& parent,
                           Placement& placement) {
    if (!ctx.shutter || !motion::can_be_carried(ctx, instance, parent.frame)) return;
    const std::optional<Shutter> seen = motion::shutter_of(ctx, instance);
    if (!seen) return;
    const Shutter shutter = *seen;
    const auto matrix_at = [&](double time) {
        return between_origins(motion::carried_by(ctx, instance, parent.frame, time),
                               placement.what->origin, parent.origin);
    };
    // Joints above may carry it, where its own transforms say nothing of that
    if (must_stay(ctx, *placement.what) || matrix_at(ctx.time.value()) != placement.matrix) {
        motion::warn_if_it_moves(ctx, instance, parent.frame);
        return;
    }
    const auto at_way = [&](double way) {
        return matrix_at(shutter.open + way * (shutter.close - shutter.open));
    };
    const double reach = reach_of(*placement.what);
    // Whether the matrices between two keys are where straight lines lead
    const auto is_straight = [&](const Mat4d& a, const Mat4d& b, double way, double step) {
        return std::none_of(std::begin(ways_between), std::end(ways_between), [&](double f) {
            return strays(at_way(way + f * step), between(a, b, f), reach);
        });
    };
    std::vector<Mat4d> keys;
    for (size_t segments = fewest_segments({}, instance, parent.frame, shutter);
         segments <= motion::max_segments; segments *= 2) {
        const double step = 1.0 / double(segments);
        keys.clear();
        for (size_t k = 0; k <= segments; ++k) keys.push_back(at_way(double(k) * step));
        size_t straight = 0;
        while (straight < segments &&
               is_straight(keys[straight], keys[straight + 1], double(straight) * step, step))
            ++straight;
        if (straight == segments) break;
    }
    if (!std::all_of(keys.begin(), keys.end(), fits_floats)) {
        ctx.warn("unsupported-motion-blur", instance,
                 "the transform of the instance is not finite while the shutter is open; the "
                 "instance is rendered without motion blur, at the frame time");
        return;
    }
    if (std::all_of(keys.begin(), keys.end(), [&](const Mat4d& m) { return m == keys[0]; })) return;
    placement.matrix = keys[0];
    placement.later.assign(keys.begin() + 1, keys.end());
}

std::vector<Mat4d> composed_motion(const Placement& inner,
                                   const Mat4d& outer,
                                   const std::vector<Mat4d>& outer_later) {
    // Both are powers of two
    size_t segments = std::max(inner.later.size(), outer_later.size());
    const auto key = [&](size_t k, size_t count) {
        return key_of(inner.matrix, inner.later, k, count) * key_of(outer, outer_later, k, count);
    };
    // What moves along with something that moves as well goes along curves, which are furthest from
    // straight lines halfway between keys
    const auto is_straight = [&] {
        for (size_t k = 0; k < segments; ++k) {
            const Mat4d straight = between(key(k, segments), key(k + 1, segments), 0.5);
            if (strays(key(2 * k + 1, 2 * segments), straight, reach_of(*inner.what))) return false;
        }
        return true;
    };
    if (!inner.later.empty() && !outer_later.empty())
        while (2 * segments <= motion::max_segments && !is_straight()) segments *= 2;
    std::vector<Mat4d> later;
    for (size_t k = 1; k <= segments; ++k) later.push_back(key(k, segments));
    return later;
}

}  // namespace velatura::translate::instancing
