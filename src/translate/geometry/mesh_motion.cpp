// SPDX-License-Identifier: Apache-2.0
#include "translate/geometry/mesh_motion.h"

#include "translate/context/instance_source.h"
#include "translate/context/values.h"
#include "translate/geometry/mesh_faces.h"
#include "translate/geometry/mesh_surface.h"
#include "translate/motion/moving_points.h"
#include "translate/motion/pose.h"
#include "translate/motion/scoped_time.h"
#include "translate/motion/shutter.h"
#include "usd/stage/skeleton.h"
#include "usd/stage/xform.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace velatura::translate::geometry {

namespace {

constexpr const char* moving_attributes[] = {"points", "normals", "primvars:normals"};

/// Whether anything that moves the mesh has more than one value.
bool can_move(Context& ctx, Prim prim, Prim frame) {
    if (motion::has_velocities(ctx, prim)) return true;
    for (const char* name : moving_attributes)
        if (prim.attribute(name).might_be_time_varying()) return true;
    return motion::can_be_carried(ctx, prim, frame);
}

class MotionReader {
  public:
    MotionReader(Context& ctx,
                 Prim prim,
                 const InstanceSource& parent,
                 const FaceTable& table,
                 const scene::Mesh& mesh,
                 const Shutter& shutter)
        : ctx_(ctx),
          prim_(prim),
          holder_(parent),
          shutter_(shutter),
          table_(table),
          mesh_(mesh),
          has_velocities_(motion::has_velocities(ctx, prim)),
          turns_(motion::can_be_carried(ctx, prim, parent.frame)) {}

    /// The mesh at equal steps; empty when it cannot be followed.
    std::vector<scene::Mesh> keys() {
        if (!has_velocities_ && changes_topology()) {
            warn_color("its topology changes");
            return {};
        }
        size_t segments = authored_segments();
        std::vector<scene::Mesh> keys;
        for (size_t k = 0; k <= segments; ++k)
            if (!add(double(k) / double(segments), keys)) return {};
        while (2 * segments <= motion::max_segments) {
            std::vector<scene::Mesh> halfway, beside;
            if (!add_between(segments, 0.5, halfway)) return {};
            if (is_straight(keys, halfway, 0.5)) {
                if (!turns_) break;
                if (!add_between(segments, motion::probe_fraction, beside)) return {};
                if (is_straight(keys, beside, motion::probe_fraction)) break;
            }
            std::vector<scene::Mesh> finer;
            for (size_t k = 0; k < segments; ++k) {
                finer.push_back(std::move(keys[k]));
                finer.push_back(std::move(halfway[k]));
            }
            finer.push_back(std::move(keys.back()));
            keys = std::move(finer);
            segments *= 2;
        }
        return keys;
    }

  private:
    bool is_open_at(double time) const { return time > shutter_.open && time < shutter_.close; }

    double time_at(double way) const {
        return shutter_.open + way * (shutter_.close - shutter_.open);
    }

    void warn_color(const char* what) {
        ctx_.note_not_simulated(scene::Effect::DeformationBlur, prim_, what);
        ctx_.warn("unsupported-motion-blur", prim_,
                  fmt::format("{} while the shutter is open: the mesh is rendered without motion "
                              "blur, at the frame time",
                              what));
    }

    bool changes_topology() const {
        for (const char* name : {"faceVertexCounts", "faceVertexIndices"}) {
            const Attribute attribute = prim_.attribute(name);
            if (!attribute.might_be_time_varying()) continue;
            // Held from sample to sample; that of the end is what the last points are meant for
            std::vector<double> times = attribute.time_samples();
            std::erase_if(times, [&](double t) { return !is_open_at(t); });
            times.insert(times.end(), {shutter_.open, shutter_.close});
            for (const double time : times)
                if (!(attribute.value(time) == attribute.value(ctx_.time))) return true;
        }
        return false;
    }

    /// The fewest equal steps at which all samples inside the shutter's time are keys.
    size_t authored_segments() const {
        std::vector<double> times = usd::stage::transform_sample_times(prim_);
        for (const Prim at : motion::chain_of(prim_, holder_.frame)) {
            const auto more = usd::stage::transform_sample_times(at);
            times.insert(times.end(), more.begin(), more.end());
        }
        for (const char* name : moving_attributes) {
            if (has_velocities_) break;
            const auto more = prim_.attribute(name).time_samples();
            times.insert(times.end(), more.begin(), more.end());
        }
        std::erase_if(times, [&](double t) { return !is_open_at(t); });
        for (size_t segments = 1; segments < motion::max_segments; ++segments) {
            const auto is_key = [&](double t) {
                const double at =
                    (t - shutter_.open) / (shutter_.close - shutter_.open) * double(segments);
                return std::abs(at - std::round(at)) < 1e-6;
            };
            if (std::all_of(times.begin(), times.end(), is_key)) return segments;
        }
        return motion::max_segments;
    }

    /// The mesh at f of the way between every two of its keys.
    bool add_between(size_t segments, double f, std::vector<scene::Mesh>& between) {
        for (size_t k = 0; k < segments; ++k)
            if (!add((double(k) + f) / double(segments), between)) return false;
        return true;
    }

    bool add(double way, std::vector<scene::Mesh>& keys) {
        const motion::ScopedTime at(ctx_, time_at(way));
        Mat4d matrix = motion::matrix_in_frame(ctx_, prim_, holder_.frame);
        std::optional<motion::Pose> pose = motion::read_pose(ctx_, prim_, holder_.frame);
        if (pose && pose->is_rigid) matrix = pose->matrix;
        if (pose) pose->matrix = relative_to(pose->matrix, holder_.origin);
        matrix = relative_to(matrix, holder_.origin);
        const std::vector<Vec3d> points = motion::read_points(ctx_, prim_, pose ? &*pose : nullptr);
        scene::Mesh key;
        key.subdivision = mesh_.subdivision;
        const auto reject = [&](const char* why) {
            ctx_.is_quiet = false;
            warn_color(why);
            return false;
        };
        if (points.size() != mesh_.points.size()) return reject("the number of its points changes");
        if (!is_finite(matrix) || !keeps_a_surface(matrix) ||
            !set_surface(ctx_, prim_, table_, points, matrix, pose ? &*pose : nullptr, key))
            return reject("its transform is singular");
        if (loses_points(key)) return reject("some points are not finite");
        keys.push_back(std::move(key));
        return true;
    }

    /// Whether a point that is somewhere at the frame's instant is nowhere.
    bool loses_points(const scene::Mesh& key) const {
        for (size_t i = 0; i < key.points.size(); ++i)
            if (is_finite(mesh_.points[i]) && !is_finite(key.points[i])) return true;
        return false;
    }

    static bool is_straight(const std::vector<scene::Mesh>& keys,
                            const std::vector<scene::Mesh>& between,
                            double f) {
        Box3 box;
        for (const scene::Mesh& key : keys)
            for (const Vec3& p : key.points)
                if (is_finite(p)) box.extendBy(p);
        if (box.isEmpty()) return true;
        const double max = motion::interpolation_tolerance * Vec3d(box.max - box.min).length();
        for (size_t k = 0; k < between.size(); ++k) {
            for (size_t i = 0; i < between[k].points.size(); ++i) {
                const Vec3d from(keys[k].points[i]), to(keys[k + 1].points[i]);
                // What is not a number strays nowhere
                if ((Vec3d(between[k].points[i]) - (from + (to - from) * f)).length() > max)
                    return false;
            }
        }
        return true;
    }

    Context& ctx_;
    Prim prim_;
    const InstanceSource& holder_;
    Shutter shutter_;
    const FaceTable& table_;
    const scene::Mesh& mesh_;
    bool has_velocities_;
    bool turns_;  ///< or may; points by themselves go straight, or along parabolas
};

bool has_same_normals(const scene::Mesh& a, const scene::Mesh& b) {
    return a.normals.size() == b.normals.size() && a.normal_indices == b.normal_indices &&
           a.normal_interpolation == b.normal_interpolation;
}

}  // namespace

void read_motion(Context& ctx,
                 Prim prim,
                 const InstanceSource& parent,
                 const Mat4d& matrix,
                 const motion::Pose* pose,
                 const FaceTable& table,
                 scene::Mesh& mesh) {
    if (!ctx.shutter || !can_move(ctx, prim, parent.frame)) return;
    const std::optional<Shutter> shutter = motion::shutter_of(ctx, prim);
    if (!shutter) return;
    const bool is_rigid = pose && pose->is_rigid;
    if (!is_rigid &&
        matrix != relative_to(motion::matrix_in_frame(ctx, prim, parent.frame), parent.origin)) {
        ctx.warn("unsupported-motion-blur", prim,
                 "the mesh is bound to a joint that moves its own ancestors; it is rendered "
                 "without motion blur, at the frame time");
        return;
    }
    std::vector<scene::Mesh> keys = MotionReader(ctx, prim, parent, table, mesh, *shutter).keys();
    if (keys.empty()) return;
    const bool has_all_normals = std::all_of(keys.begin(), keys.end(), [&](const scene::Mesh& key) {
        return has_same_normals(key, mesh);
    });
    if (!has_all_normals)
        ctx.warn("bad-normals", prim,
                 "the number of normals changes while the shutter is open; those of the frame time "
                 "are used");
    const bool has_same_points = std::all_of(
        keys.begin(), keys.end(), [&](const auto& key) { return key.points == keys[0].points; });
    const bool normals_stay = std::all_of(
        keys.begin(), keys.end(), [&](const auto& key) { return key.normals == keys[0].normals; });
    const bool is_still = has_same_points && normals_stay;
    if (is_still)
        ctx.note_zero(scene::Effect::DeformationBlur, prim,
                      "the same all the time the shutter is open");
    mesh.points = std::move(keys[0].points);
    if (has_all_normals) mesh.normals = std::move(keys[0].normals);
    for (size_t k = 1; k < keys.size() && !is_still; ++k) {
        mesh.later_points.push_back(std::move(keys[k].points));
        if (has_all_normals && !normals_stay)
            mesh.later_normals.push_back(std::move(keys[k].normals));
    }
}

}  // namespace velatura::translate::geometry
