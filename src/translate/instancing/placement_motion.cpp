// SPDX-License-Identifier: Apache-2.0
#include "translate/instancing/placement_motion.h"

#include "translate/context/instance_source.h"
#include "translate/context/values.h"
#include "translate/lights/lights.h"
#include "translate/motion/scoped_time.h"
#include "translate/motion/shutter.h"
#include "translate/motion/unblurred.h"
#include "usd/stage/xform.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>
#include <optional>
#include <string_view>
#include <variant>

namespace velatura::translate::instancing {

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
    for (const LightSite& site : what.lights)
        if (lights::has_place(site.prim.type_name().view()))
            reach = std::max(reach, reach_of(site.reach, site.matrix));
    for (const scene::Volume& volume : what.volumes)
        reach = std::max(reach, reach_of(reach_of(volume), volume.render_from_volume));
    for (const Placement& inner : what.placements)
        reach = std::max(
            reach, reach_of(*inner.what) * largest_row(inner.matrix) + translation(inner.matrix));
    // Lights at infinity have no reach, but turns of them count as those of anything else
    if (reach == 0.0 && !what.lights.empty()) reach = 1.0;
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

std::vector<Mat4d> read_carried_keys(Context& ctx,
                                     Prim prim,
                                     const InstanceSource& parent,
                                     const PrimMotion& placed) {
    if (!ctx.shutter || !motion::can_be_carried(ctx, prim, parent.frame)) return {};
    const std::optional<Shutter> seen = motion::shutter_of(ctx, prim);
    if (!seen) return {};
    const Shutter shutter = *seen;
    const auto matrix_at = [&](double time) {
        return between_origins(motion::carried_by(ctx, prim, parent.frame, time), placed.origin,
                               parent.origin);
    };
    // Joints above may carry it, where its own transforms say nothing of that
    if (matrix_at(ctx.time.value()) != placed.matrix) {
        motion::warn_if_it_moves(ctx, prim, parent.frame);
        return {};
    }
    const auto at_way = [&](double way) {
        return matrix_at(shutter.open + way * (shutter.close - shutter.open));
    };
    // Whether the matrices between two keys are where straight lines lead
    const auto is_straight = [&](const Mat4d& a, const Mat4d& b, double way, double step) {
        return std::none_of(std::begin(ways_between), std::end(ways_between), [&](double f) {
            return strays(at_way(way + f * step), between(a, b, f), placed.reach);
        });
    };
    std::vector<Mat4d> keys;
    for (size_t segments = fewest_segments({}, prim, parent.frame, shutter);
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
        ctx.warn("unsupported-motion-blur", prim,
                 fmt::format("the transform of the {} is not finite while the shutter is open; it "
                             "is rendered without motion blur, at the frame time",
                             prim.is_instance() ? "instance" : prim.type_name().str()));
        return {};
    }
    if (std::all_of(keys.begin(), keys.end(), [&](const Mat4d& m) { return m == keys[0]; }))
        return {};
    return keys;
}

namespace {

/// The first key, and those after it.
void take_keys(std::vector<Mat4d>& keys, Mat4d& matrix, std::vector<Mat4d>& later) {
    if (keys.empty()) return;
    matrix = keys[0];
    later.assign(keys.begin() + 1, keys.end());
}

/// Light and volumes are looked up by inverses.
bool is_flat_somewhere(Context& ctx, Prim prim, const std::vector<Mat4d>& keys) {
    if (std::all_of(keys.begin(), keys.end(), keeps_a_surface)) return false;
    ctx.warn("unsupported-motion-blur", prim,
             fmt::format("the transform of the {} is singular while the shutter is open; it is "
                         "rendered without motion blur, at the frame time",
                         prim.type_name().str()));
    return true;
}

}  // namespace

void read_placement_motion(Context& ctx,
                           Prim instance,
                           const InstanceSource& parent,
                           Placement& placement) {
    if (!ctx.shutter) return;
    std::vector<Mat4d> keys =
        read_carried_keys(ctx, instance, parent,
                          {placement.what->origin, placement.matrix, reach_of(*placement.what)});
    take_keys(keys, placement.matrix, placement.later);
}

namespace {

/// Largest distance of a prim from the origin of what it stands in, of the frame's instant and both
/// ends of the shutter.
double largest_distance(Context& ctx, const InstanceSource& parent, const LightSite& site) {
    double distance = translation(site.matrix);
    if (!motion::can_be_carried(ctx, site.prim, parent.frame)) return distance;
    const std::optional<Shutter> shutter = motion::shutter_of(ctx, site.prim);
    if (!shutter) return distance;
    for (const double time : {shutter->open, shutter->close})
        distance = std::max(distance, translation(between_origins(
                                          motion::carried_by(ctx, site.prim, parent.frame, time),
                                          Vec3d(0.0), parent.origin)));
    return distance;
}

/// How far a light reaches, to follow it by: one that is a point has no size to measure curves by,
/// then what is small beside its way counts.
double followed_reach(Context& ctx, const InstanceSource& parent, const LightSite& site) {
    constexpr double of_distance = 1e-3;
    const double reach = lights::reach_of_light(ctx, site.prim), row = largest_row(site.matrix);
    if (!(row > 0.0)) return reach;
    return std::max(reach, of_distance * largest_distance(ctx, parent, site) / row);
}

}  // namespace

void read_light_motion(Context& ctx, const InstanceSource& parent, LightSite& site) {
    if (!ctx.shutter) return;
    const std::string_view type = site.prim.type_name().view();
    const bool is_infinite = lights::is_light_type(type) && !lights::has_place(type);
    // Of what is at infinity only turns count; of geometry that is a light those of its shaping
    site.reach = is_infinite                   ? 1e18
                 : lights::is_light_type(type) ? followed_reach(ctx, parent, site)
                                               : 1.0;
    const Vec3d origin(0.0);
    std::vector<Mat4d> keys =
        read_carried_keys(ctx, site.prim, parent, {origin, site.matrix, site.reach});
    if (keys.empty() || is_flat_somewhere(ctx, site.prim, keys)) return;
    if (is_infinite) {
        for (Mat4d& key : keys)
            for (int k = 0; k < 3; ++k) key[3][k] = site.matrix[3][k];
        if (std::all_of(keys.begin(), keys.end(), [&](const Mat4d& m) { return m == keys[0]; }))
            return;
    }
    take_keys(keys, site.matrix, site.later);
}

double reach_of(const scene::Volume& volume) {
    if (volume.extent.isEmpty()) return 1.0;
    double reach = 0;
    for (int k = 0; k < 3; ++k)
        reach = std::max({reach, std::abs(volume.extent.min[k]), std::abs(volume.extent.max[k])});
    return reach;
}

void read_volume_motion(Context& ctx,
                        Prim prim,
                        const InstanceSource& parent,
                        scene::Volume& volume) {
    if (!ctx.shutter) return;
    const Vec3d origin(0.0);
    std::vector<Mat4d> keys =
        read_carried_keys(ctx, prim, parent, {origin, volume.render_from_volume, reach_of(volume)});
    if (keys.empty()) return;
    const bool is_flat = std::any_of(keys.begin(), keys.end(),
                                     [](const Mat4d& m) { return determinant3(m) == 0.0; });
    if (is_flat || is_flat_somewhere(ctx, prim, keys)) return;
    take_keys(keys, volume.render_from_volume, volume.later_render_from_volume);
}

std::vector<Mat4d> composed_motion(const InnerMotion& inner,
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
            if (strays(key(2 * k + 1, 2 * segments), straight, inner.reach)) return false;
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
