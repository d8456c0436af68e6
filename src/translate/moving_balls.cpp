// SPDX-License-Identifier: Apache-2.0
#include "translate/another_time.h"
#include "translate/mesh_surface.h"
#include "translate/motion.h"
#include "translate/parts.h"
#include "translate/placement_motion.h"
#include "translate/pose.h"
#include "translate/strands.h"
#include "translate/values.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace velatura::translate {

namespace {

/// Instances take a hundred times the memory of balls: about 1.4 kB while they are read.
constexpr size_t most_balls = size_t(1) << 20;

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
            if (!has_velocities(ctx_, prim_) || name != std::string_view("points"))
                times.insert(times.end(), more.begin(), more.end());
        }
        std::sort(times.begin(), times.end());
        times.erase(std::unique(times.begin(), times.end()), times.end());
        return times;
    }

    /// Whether points that samples lead to are those of the frame.
    bool keeps_its_points(const Shutter& shutter) const {
        if (has_velocities(ctx_, prim_)) return true;
        const Attribute ids = prim_.attribute("ids"), points = prim_.attribute("points");
        const std::vector<double> times = times_seen(points.time_samples(), shutter);
        return std::all_of(times.begin(), times.end(), [&](double time) {
            return points.value(time).array_size() == count() &&
                   ids.value(time) == ids.value(ctx_.frame);
        });
    }

  private:
    InstanceRows read(TimeCode time) const {
        const AnotherTime at(ctx_, time);
        const std::optional<Pose> pose = read_pose(ctx_, prim_, Prim());
        const std::vector<Vec3d> points = read_points(ctx_, prim_, pose ? &*pose : nullptr);
        InstanceRows rows;
        for (const Vec3d& p : points) rows.positions.insert(rows.positions.end(), {p.x, p.y, p.z});
        std::optional<ElementRows> widths;
        if (!read_element_rows(ctx_, prim_, "widths", 1, {1, points.size(), 0}, widths))
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
/// an instance cannot hand down. colors: displayColor by point, if it is not one for all.
std::optional<scene::Shape> shared_ball(const Context& ctx,
                                        const scene::Shape& still,
                                        std::vector<Rgb>& colors) {
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
        if (name != scene::display_color_primvar || primvar.width != 3) return std::nullopt;
        for (size_t i = 0; i < cloud.points.size(); ++i) {
            const size_t row = primvar.indices.empty() ? i : primvar.indices[i];
            const float* c = &primvar.values[3 * row];
            colors.emplace_back(c[0], c[1], c[2]);
        }
    }
    scene::Shape shape = still;
    shape.geometry = std::move(ball);
    return shape;
}

}  // namespace

bool place_moving_balls(
    Context& ctx, Prim prim, const Mat4d& matrix, const scene::Shape& still, Placeable& holder) {
    const std::optional<Shutter> shutter = shutter_of(ctx, prim);
    if (!shutter || !changes_shape(ctx, prim, holder.frame)) return false;
    if (carried_by(ctx, prim, holder.frame, ctx.frame) != matrix) return false;
    std::vector<Rgb> colors;
    std::optional<scene::Shape> ball = shared_ball(ctx, still, colors);
    const BallRows balls(ctx, prim);
    if (!ball || balls.count() > most_balls || !balls.keeps_its_points(*shutter)) return false;

    auto own = std::make_unique<Placeable>();
    own->name = prim.path_string();
    own->frame = prim;
    own->shapes.push_back(*std::move(ball));
    if (must_stay(ctx, *own)) return false;
    const InstanceRows now = balls.at(ctx.frame);
    const Mat4d holder_from_prim = relative_to(matrix, holder.origin);
    const size_t first = holder.placements.size();
    std::vector<size_t> placed;
    for (size_t i = 0; i < balls.count(); ++i) {
        // Those that are left out were named
        const Mat4d local = now.matrix(i);
        if (!(now.scales[3 * i] > 0.0) || !is_finite(local)) continue;
        Placement placement;
        placement.what = own.get();
        placement.matrix = local * holder_from_prim;
        placement.provenance = still.provenance;
        if (!colors.empty()) placement.display_color = colors[i];
        holder.placements.push_back(std::move(placement));
        placed.push_back(i);
    }
    ctx.placeables[fmt::format("balls {} {}", ctx.placeables.size(), own->name)] = std::move(own);
    read_keys(ctx, prim, balls, holder, {std::span(holder.placements).subspan(first), placed},
              *shutter);
    return true;
}

}  // namespace velatura::translate
