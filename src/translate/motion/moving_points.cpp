// SPDX-License-Identifier: Apache-2.0
#include "translate/motion/moving_points.h"

#include "translate/context/values.h"
#include "translate/motion/pose.h"
#include "translate/motion/scoped_time.h"
#include "translate/motion/velocities.h"

#include <optional>

namespace velatura::translate::motion {

namespace {

std::vector<Vec3d> points_of(const usd::layer::Value& value) {
    std::vector<double> rows;
    int width = 0;
    std::vector<Vec3d> points;
    if (!read_rows(value, rows, width) || width != 3) return points;
    points.reserve(rows.size() / 3);
    for (size_t i = 0; i + 2 < rows.size(); i += 3)
        points.emplace_back(rows[i], rows[i + 1], rows[i + 2]);
    return points;
}

std::optional<Velocities> read_point_velocities(Context& ctx, Prim prim, size_t points) {
    return read_velocities(ctx, prim.attribute("points"), points, "velocities", "accelerations");
}

}  // namespace

std::vector<Vec3d> read_points(Context& ctx, Prim prim, const Pose* pose) {
    const Attribute attribute = prim.attribute("points");
    std::vector<Vec3d> points;
    std::optional<Velocities> velocities;
    if (prim.attribute("velocities").has_authored_value()) {
        points = points_of(attribute.value(held_time(attribute, ctx.frame)));
        velocities = read_point_velocities(ctx, prim, points.size());
    }
    if (velocities) {
        for (size_t i = 0; i < points.size(); ++i)
            for (size_t k = 0; k < 3; ++k)
                points[i][int(k)] += velocities->way(i, k, ctx.time.value());
    } else {
        points = points_of(attribute.value(ctx.time));
    }
    if (pose) pose->deform_points(points);
    return points;
}

bool has_velocities(Context& ctx, Prim prim) {
    if (!prim.attribute("velocities").has_authored_value()) return false;
    const ScopedTime quietly(ctx, ctx.time);
    const Attribute points = prim.attribute("points");
    const size_t count = points.value(held_time(points, ctx.frame)).array_size();
    return read_point_velocities(ctx, prim, count).has_value();
}

}  // namespace velatura::translate::motion
