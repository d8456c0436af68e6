// SPDX-License-Identifier: Apache-2.0
#include "translate/instancing/instancer_places.h"

#include "translate/context/values.h"
#include "translate/motion/velocities.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace velatura::translate::instancing {

namespace {

/// Rows of an array attribute; empty with a warning when their number is not that of the instances.
std::vector<double> read_array(Context& ctx,
                               const Attribute& attribute,
                               TimeCode time,
                               int wanted_width,
                               size_t instances,
                               const char* fallback) {
    std::vector<double> rows;
    int width = 0;
    if (!read_rows(attribute.value(time), rows, width)) {
        const usd::layer::Value value = attribute.value(time);
        if (!value.is_empty() && !value.is_block())
            ctx.warn("bad-instancer", attribute,
                     fmt::format("{} is not numeric; it is ignored, and instances {}",
                                 attribute.name().str(), fallback));
        return {};
    }
    if (rows.empty()) return {};
    if (width == wanted_width && rows.size() == instances * size_t(width)) return rows;
    ctx.warn("bad-instancer", attribute,
             fmt::format("{} has {} elements, expected {}; it is ignored, and instances {}",
                         attribute.name().str(), rows.size() / size_t(width), instances, fallback));
    return {};
}

/// Puts in rows what the attribute holds at a time, if it is as much.
void read_again(const Attribute& attribute, TimeCode time, std::vector<double>& rows) {
    std::vector<double> again;
    int width = 0;
    if (read_rows(attribute.value(time), again, width) && again.size() == rows.size())
        rows = std::move(again);
}

/// Turns instance i after its own orientation by degrees around the axis of that way.
void turn(const motion::Velocities& turning,
          size_t i,
          double time,
          std::vector<double>& orientations) {
    const Vec3d way(turning.way(i, 0, time), turning.way(i, 1, time), turning.way(i, 2, time));
    const double degrees = way.length();
    if (!(degrees > 0.0)) return;
    const double half = degrees * pi_d / 360;
    const Vec3d v = way * (std::sin(half) / degrees);
    const double w = std::cos(half);
    // The product of quaternions, what turns last at the left
    double* const q = &orientations[4 * i];
    const Vec3d p(q[0], q[1], q[2]);
    const Vec3d product = p * w + v * q[3] + v.cross(p);
    q[3] = w * q[3] - v.dot(p);
    for (int k = 0; k < 3; ++k) q[k] = product[k];
}

void warn_of_lost_turns(Context& ctx, const Attribute& attribute, const std::vector<double>& rows) {
    size_t lost = 0;
    for (size_t i = 0; i + 3 < rows.size(); i += 4)
        lost += !std::isfinite(rows[i] + rows[i + 1] + rows[i + 2] + rows[i + 3]);
    if (lost > 0)
        ctx.warn("bad-instancer", attribute,
                 fmt::format("{} of {} {} are not finite; these instances are not turned", lost,
                             rows.size() / 4, attribute.name().str()));
}

}  // namespace

std::vector<double> times_seen(std::vector<double> times, const Shutter& shutter) {
    const auto after = std::lower_bound(times.begin(), times.end(), shutter.close);
    if (after != times.end()) times.erase(after + 1, times.end());
    const auto open = std::upper_bound(times.begin(), times.end(), shutter.open);
    if (open != times.begin()) times.erase(times.begin(), open - 1);
    return times;
}

Mat4d InstanceRows::matrix(size_t i) const {
    Mat4d m;
    if (!orientations.empty()) {
        const double* q = &orientations[4 * i];
        const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
        if (length > 0.0 && std::isfinite(length)) {
            const double x = q[0] / length, y = q[1] / length, z = q[2] / length, w = q[3] / length;
            m = Mat4d(1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (z * x - y * w), 0,
                      2 * (x * y - z * w), 1 - 2 * (z * z + x * x), 2 * (y * z + x * w), 0,
                      2 * (z * x + y * w), 2 * (y * z - x * w), 1 - 2 * (y * y + x * x), 0, 0, 0, 0,
                      1);
        }
    }
    if (!scales.empty())
        for (size_t r = 0; r < 3; ++r)
            for (int c = 0; c < 3; ++c) m[int(r)][c] *= scales[3 * i + r];
    if (!positions.empty())
        for (int c = 0; c < 3; ++c) m[3][c] = positions[3 * i + size_t(c)];
    return m;
}

InstancerPlaces::InstancerPlaces(Context& ctx, Prim prim, size_t instances)
    : prim_(prim),
      frame_(ctx.frame),
      positions_(prim.attribute("positions")),
      scales_(prim.attribute("scales")),
      orientations_(prim.attribute("orientationsf")) {
    if (orientations_.value(frame_).array_size() == 0)
        orientations_ = prim.attribute("orientations");
    velocities_ =
        motion::read_velocities(ctx, positions_, instances, "velocities", "accelerations");
    turning_ = motion::read_velocities(ctx, orientations_, instances, "angularVelocities");
    const auto read = [&](const Attribute& attribute, int width, const char* fallback) {
        const TimeCode time = has_velocities() ? motion::held_time(attribute, frame_) : frame_;
        return read_array(ctx, attribute, time, width, instances, fallback);
    };
    base_ = {read(positions_, 3, "are at the origin"), read(scales_, 3, "are not scaled"),
             read(orientations_, 4, "are not turned")};
    warn_of_lost_turns(ctx, orientations_, base_.orientations);
    if (base_.positions.empty()) velocities_.reset();
    if (base_.orientations.empty()) turning_.reset();
}

InstanceRows InstancerPlaces::at(TimeCode time) const {
    InstanceRows rows = base_;
    if (velocities_) {
        for (size_t i = 0; i < rows.positions.size(); ++i)
            rows.positions[i] += velocities_->way(i / 3, i % 3, time.value());
    }
    if (turning_) {
        for (size_t i = 0; i < rows.orientations.size() / 4; ++i)
            turn(*turning_, i, time.value(), rows.orientations);
    }
    if (has_velocities() || time.value() == frame_.value() || time.is_default()) return rows;
    read_again(positions_, time, rows.positions);
    read_again(scales_, time, rows.scales);
    read_again(orientations_, time, rows.orientations);
    return rows;
}

bool InstancerPlaces::can_move() const {
    return has_velocities() || positions_.might_be_time_varying() ||
           scales_.might_be_time_varying() || orientations_.might_be_time_varying();
}

bool InstancerPlaces::is_renumbered(const Shutter& shutter) const {
    if (has_velocities()) return false;
    const std::vector<double> times = times_seen(sample_times(), shutter);
    for (const char* name : {"ids", "protoIndices"}) {
        const Attribute attribute = prim_.attribute(name);
        if (!attribute.might_be_time_varying()) continue;
        for (const double time : times)
            if (!(attribute.value(time) == attribute.value(frame_))) return true;
    }
    return false;
}

std::vector<double> InstancerPlaces::sample_times() const {
    std::vector<double> times;
    if (has_velocities()) return times;
    for (const Attribute& attribute : {positions_, scales_, orientations_}) {
        const std::vector<double> more = attribute.time_samples();
        times.insert(times.end(), more.begin(), more.end());
    }
    std::sort(times.begin(), times.end());
    times.erase(std::unique(times.begin(), times.end()), times.end());
    return times;
}

}  // namespace velatura::translate::instancing
