// SPDX-License-Identifier: Apache-2.0
#include "translate/motion/velocities.h"

#include "translate/context/values.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace velatura::translate::motion {

namespace {

/// The samples around a time: the last that is not later, and the first that is.
struct Bracket {
    double lower = 0, upper = 0;

    bool is_that_of(const Bracket& other) const {
        constexpr double epsilon = std::numeric_limits<double>::epsilon();
        return std::abs(lower - other.lower) <= epsilon && std::abs(upper - other.upper) <= epsilon;
    }
};

/// Beyond the first or last sample both are that one.
std::optional<Bracket> bracket(const Attribute& attribute, double time) {
    const std::vector<double> times = attribute.time_samples();
    if (times.empty()) return std::nullopt;
    const auto after = std::upper_bound(times.begin(), times.end(), time);
    const double lower = after == times.begin() ? times.front() : *(after - 1);
    const bool is_outside = after == times.begin() || after == times.end();
    return Bracket{lower, is_outside ? lower : *after};
}

/// Rows of three of the sample that `carried` has there as well; empty, with a warning, where the
/// samples or their sizes differ.
std::vector<double> read_aligned(Context& ctx,
                                 const Attribute& attribute,
                                 const Attribute& carried,
                                 size_t elements) {
    std::vector<double> rows;
    int width = 0;
    const TimeCode held = held_time(attribute, ctx.frame);
    if (!read_rows(attribute.value(held), rows, width) || rows.empty()) return {};
    const auto reject = [&](const std::string& why) {
        ctx.warn("unused-velocities", attribute,
                 fmt::format("{} {}; they are ignored, and {} is interpolated between samples",
                             attribute.name().str(), why, carried.name().str()));
        return std::vector<double>();
    };
    const auto own = bracket(attribute, ctx.frame.value());
    const auto other = bracket(carried, ctx.frame.value());
    if (!own || !other || !own->is_that_of(*other))
        return reject(
            fmt::format("have no samples at the times of those of {}", carried.name().str()));
    if (width != 3 || rows.size() != 3 * elements)
        return reject(
            fmt::format("has {} elements, expected {}", rows.size() / size_t(width), elements));
    size_t infinite = 0;
    for (double& number : rows) {
        if (std::isfinite(number)) continue;
        number = 0.0;
        ++infinite;
    }
    if (infinite > 0)
        ctx.warn("bad-velocities", attribute,
                 fmt::format("{} values of {} are not finite; they are set to 0", infinite,
                             attribute.name().str()));
    return rows;
}

}  // namespace

TimeCode held_time(const Attribute& attribute, TimeCode time) {
    if (time.is_default()) return time;
    const auto samples = bracket(attribute, time.value());
    return samples ? TimeCode(samples->lower) : TimeCode();
}

std::optional<Velocities> read_velocities(Context& ctx,
                                          const Attribute& carried,
                                          size_t elements,
                                          const char* velocities,
                                          const char* accelerations) {
    // Without a time there is none to go on from
    const Attribute attribute = carried.prim().attribute(velocities);
    if (ctx.frame.is_default() || !attribute.has_authored_value()) return std::nullopt;
    Velocities out;
    out.values = read_aligned(ctx, attribute, carried, elements);
    if (out.values.empty()) return std::nullopt;
    out.since = held_time(carried, ctx.frame);
    out.seconds_per_time = inherited_number(ctx, carried.prim(), "motion:velocityScale", 1.0) /
                           ctx.stage.time_codes_per_second();
    if (accelerations != nullptr) {
        const Attribute second = carried.prim().attribute(accelerations);
        if (second.has_authored_value())
            out.accelerations = read_aligned(ctx, second, attribute, elements);
    }
    return out;
}

double inherited_number(Context& ctx, Prim prim, const char* name, double fallback) {
    for (Prim at = prim; at && !at.is_pseudo_root(); at = at.parent()) {
        const Attribute attribute = at.attribute(name);
        if (!attribute.has_authored_value()) continue;
        const double number = read_number(attribute, fallback, ctx.frame);
        if (std::isfinite(number)) return number;
        ctx.warn("bad-motion-scale", attribute,
                 fmt::format("{} is {}, {} is used", name, number, fallback));
        return fallback;
    }
    return fallback;
}

}  // namespace velatura::translate::motion
