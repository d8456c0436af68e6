// SPDX-License-Identifier: Apache-2.0
#include "translate/instancing/moving_spheres.h"

#include "translate/context/instance_source.h"
#include "translate/context/values.h"
#include "translate/geometry/strands.h"
#include "translate/instancing/instancer_motion.h"
#include "translate/instancing/instancer_places.h"
#include "translate/instancing/instancer_primvars.h"
#include "translate/instancing/instancing.h"
#include "translate/instancing/placement_motion.h"
#include "translate/motion/moving_points.h"
#include "translate/motion/pose.h"
#include "translate/motion/scoped_time.h"
#include "translate/motion/shutter.h"
#include "translate/motion/unblurred.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace velatura::translate::instancing {

namespace {

/// Instances take a hundred times the memory of balls: about 1.4 kB while they are read.
constexpr size_t max_balls = size_t(1) << 20;

/// Where the balls of a Points prim are, and how wide.
class BallRows final : public MovingRows {
  public:
    BallRows(Context& ctx, Prim prim) : ctx_(ctx), prim_(prim), base_(read(ctx.frame)) {}

    size_t count() const { return base_.positions.size() / 3; }

    InstanceRows at(TimeCode time) const override {
        InstanceRows rows = read(time);
        const bool is_same = rows.positions.size() == base_.positions.size() &&
                             rows.scales.size() == base_.scales.size();
        return is_same ? rows : base_;
    }

    std::vector<double> sample_times() const override {
        std::vector<double> times;
        for (const char* name : {"points", "widths", "primvars:widths"}) {
            const std::vector<double> more = prim_.attribute(name).time_samples();
            if (!motion::has_velocities(ctx_, prim_) || name != std::string_view("points"))
                times.insert(times.end(), more.begin(), more.end());
        }
        std::sort(times.begin(), times.end());
        times.erase(std::unique(times.begin(), times.end()), times.end());
        return times;
    }

    /// Whether points that samples lead to are those of the frame.
    bool keeps_its_points(const Shutter& shutter) const {
        if (motion::has_velocities(ctx_, prim_)) return true;
        const Attribute ids = prim_.attribute("ids"), points = prim_.attribute("points");
        const std::vector<double> times = times_seen(points.time_samples(), shutter);
        return std::all_of(times.begin(), times.end(), [&](double time) {
            return points.value(time).array_size() == count() &&
                   ids.value(time) == ids.value(ctx_.frame);
        });
    }

  private:
    InstanceRows read(TimeCode time) const {
        const motion::ScopedTime at(ctx_, time);
        const std::optional<motion::Pose> pose = motion::read_pose(ctx_, prim_, Prim());
        const std::vector<Vec3d> points = motion::read_points(ctx_, prim_, pose ? &*pose : nullptr);
        InstanceRows rows;
        for (const Vec3d& p : points) rows.positions.insert(rows.positions.end(), {p.x, p.y, p.z});
        std::optional<geometry::ElementRows> widths;
        // Without widths that fit this time has none of its own
        if (!geometry::read_widths(ctx_, prim_, {1, points.size(), 0}, widths) &&
            time.value() != ctx_.frame.value())
            return rows;
        for (size_t i = 0; i < points.size(); ++i) {
            double width = 1.0;
            if (widths) width = widths->values[widths->values.size() == 1 ? 0 : i];
            rows.scales.insert(rows.scales.end(), 3, width);
        }
        return rows;
    }

    Context& ctx_;
    Prim prim_;
    InstanceRows base_;
};

/// The ball of width 1 that all are instances of; nothing where each has something of its own that
/// an instance cannot hand down. by_point: primvars that are not one for all.
std::optional<scene::Shape> shared_ball(const Context& ctx,
                                        const scene::Shape& still,
                                        std::vector<const scene::Primvar*>& by_point) {
    const auto& cloud = std::get<scene::Points>(still.geometry);
    scene::Points ball;
    ball.points = {Vec3(0.0f)};
    ball.widths = {1.0f};
    for (const scene::Primvar& primvar : cloud.primvars) {
        const std::string_view name = ctx.scene.primvar_names[primvar.name];
        const auto& rows_of_space = scene::object_space_primvars;
        if (std::find(rows_of_space.begin(), rows_of_space.end(), name) != rows_of_space.end())
            return std::nullopt;
        if (primvar.interpolation == scene::Interpolation::Constant ||
            primvar.interpolation == scene::Interpolation::Uniform) {
            ball.primvars.push_back(primvar);
            continue;
        }
        by_point.push_back(&primvar);
    }
    std::ranges::sort(by_point, {}, &scene::Primvar::name);
    scene::Shape shape = still;
    shape.geometry = std::move(ball);
    return shape;
}

/// What each ball has of the primvars by point.
ValueRange values_of(Context& ctx, const std::vector<const scene::Primvar*>& by_point, size_t i) {
    std::vector<scene::InstanceValue> values;
    for (const scene::Primvar* primvar : by_point) {
        const size_t row = primvar->indices.empty() ? i : primvar->indices[i];
        scene::InstanceValue value;
        value.name = primvar->name;
        value.width = primvar->width;
        std::copy_n(&primvar->values[row * primvar->width], primvar->width, value.values.begin());
        values.push_back(value);
    }
    return add_values(ctx.scene, values);
}

}  // namespace

bool place_moving_spheres(Context& ctx,
                          Prim prim,
                          const Mat4d& matrix,
                          const scene::Shape& still,
                          InstanceSource& parent) {
    const std::optional<Shutter> shutter = motion::shutter_of(ctx, prim);
    if (!shutter || !motion::changes_shape(ctx, prim, parent.frame)) return false;
    if (motion::carried_by(ctx, prim, parent.frame, ctx.frame) != matrix) return false;
    std::vector<const scene::Primvar*> by_point;
    std::optional<scene::Shape> ball = shared_ball(ctx, still, by_point);
    const BallRows balls(ctx, prim);
    if (!ball || balls.count() > max_balls || !balls.keeps_its_points(*shutter)) return false;

    auto own = std::make_unique<InstanceSource>();
    own->name = prim.path_string();
    own->frame = prim;
    own->shapes.push_back(*std::move(ball));
    const InstanceRows now = balls.at(ctx.frame);
    const Mat4d holder_from_prim = relative_to(matrix, parent.origin);
    const size_t first = parent.placements.size();
    std::vector<size_t> placed;
    for (size_t i = 0; i < balls.count(); ++i) {
        // Those that are left out were named
        const Mat4d local = now.matrix(i);
        if (!(now.scales[3 * i] > 0.0) || !is_finite(local)) continue;
        Placement placement;
        placement.what = own.get();
        placement.matrix = local * holder_from_prim;
        placement.provenance = still.provenance;
        const ValueRange values = values_of(ctx, by_point, i);
        placement.first_value = values.first;
        placement.value_count = values.count;
        parent.placements.push_back(std::move(placement));
        placed.push_back(i);
    }
    auto& known = ctx.state<InstanceSources>().by_key;
    known[fmt::format("balls {} {}", known.size(), own->name)] = std::move(own);
    read_keys(ctx, prim, balls, parent, {std::span(parent.placements).subspan(first), placed},
              *shutter);
    return true;
}

}  // namespace velatura::translate::instancing
