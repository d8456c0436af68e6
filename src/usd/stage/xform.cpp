// SPDX-License-Identifier: Apache-2.0
#include "usd/stage/xform.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace velatura::usd::stage {

namespace {

constexpr std::string_view invert_prefix = "!invert!";
constexpr std::string_view reset_name = "!resetXformStack!";
constexpr std::string_view op_prefix = "xformOp:";

/// "xformOp:rotateXYZ:pivot" → "rotateXYZ"; empty when the prefix is missing.
std::string op_type(std::string_view name) {
    if (!name.starts_with(op_prefix)) return {};
    name.remove_prefix(op_prefix.size());
    return std::string(name.substr(0, name.find(':')));
}

/// Rotation about x (0), y (1) or z (2), exact at multiples of 90 degrees.
Mat4d rotation(int axis, double degrees) {
    const double turn = std::fmod(degrees, 360.0);
    double s = std::sin(turn * (pi_d / 180.0));
    double c = std::cos(turn * (pi_d / 180.0));
    if (std::fmod(turn, 90.0) == 0.0) {
        s = std::round(s);
        c = std::round(c);
    }
    const int i = (axis + 1) % 3;
    const int j = (axis + 2) % 3;
    Mat4d m;
    m[i][i] = c;
    m[i][j] = s;
    m[j][i] = -s;
    m[j][j] = c;
    return m;
}

Mat4d translation(const Vec3d& t) {
    Mat4d m;
    m.setTranslation(t);
    return m;
}

Mat4d scaling(const Vec3d& s) {
    Mat4d m;
    m.setScale(s);
    return m;
}

Mat4d quaternion_rotation(const layer::QuatDouble& q) {
    const double length2 = q.r * q.r + q.v.dot(q.v);
    if (!(length2 > 0.0)) return {};
    const double k = 2.0 / length2;
    const double w = q.r, x = q.v.x, y = q.v.y, z = q.v.z;
    return Mat4d(1.0 - k * (y * y + z * z), k * (x * y + z * w), k * (x * z - y * w), 0.0,
                 k * (x * y - z * w), 1.0 - k * (x * x + z * z), k * (y * z + x * w), 0.0,
                 k * (x * z + y * w), k * (y * z - x * w), 1.0 - k * (x * x + y * y), 0.0, 0.0, 0.0,
                 0.0, 1.0);
}

/// Axis 0–2 of the last letter of "rotateX", "translateY", …; -1 for other names.
int single_axis(std::string_view type, std::string_view stem) {
    if (type.size() != stem.size() + 1 || !type.starts_with(stem)) return -1;
    const char axis = type.back();
    return axis >= 'X' && axis <= 'Z' ? axis - 'X' : -1;
}

enum class OpState { Ok, NoValue, UnknownType, WrongValue };

OpState op_matrix(const std::string& type, const Attribute& attribute, TimeCode time, Mat4d& m) {
    // At that time: samples say nothing of the default one
    const auto without = [&] {
        return attribute.value(time).is_empty() ? OpState::NoValue : OpState::WrongValue;
    };
    const auto vector = [&](const auto& make) {
        const auto v = attribute.get<Vec3d>(time);
        if (v) m = make(*v);
        return v ? OpState::Ok : without();
    };
    const auto scalar = [&](const auto& make) {
        const auto v = attribute.get<double>(time);
        if (v) m = make(*v);
        return v ? OpState::Ok : without();
    };
    if (type == "translate") return vector([](const Vec3d& v) { return translation(v); });
    if (type == "scale") return vector([](const Vec3d& v) { return scaling(v); });
    if (type == "transform") {
        const auto v = attribute.get<Mat4d>(time);
        if (v) m = *v;
        return v ? OpState::Ok : without();
    }
    if (type == "orient") {
        const auto v = attribute.get<layer::QuatDouble>(time);
        if (v) m = quaternion_rotation(*v);
        return v ? OpState::Ok : without();
    }
    if (const int axis = single_axis(type, "rotate"); axis >= 0) {
        return scalar([axis](double degrees) { return rotation(axis, degrees); });
    }
    if (const int axis = single_axis(type, "translate"); axis >= 0) {
        return scalar([axis](double x) {
            Vec3d t(0.0);
            t[axis] = x;
            return translation(t);
        });
    }
    if (const int axis = single_axis(type, "scale"); axis >= 0) {
        return scalar([axis](double x) {
            Vec3d s(1.0);
            s[axis] = x;
            return scaling(s);
        });
    }
    if (type.size() == 9 && type.starts_with("rotate")) {
        // The first letter is the innermost rotation: it meets the point first
        std::array<int, 3> axes{};
        std::array<bool, 3> used{};
        for (size_t i = 0; i < 3; ++i) {
            const char letter = type[6 + i];
            if (letter < 'X' || letter > 'Z') return OpState::UnknownType;
            axes[i] = letter - 'X';
            used[size_t(axes[i])] = true;
        }
        if (!(used[0] && used[1] && used[2])) return OpState::UnknownType;
        return vector([axes](const Vec3d& degrees) {
            return rotation(axes[0], degrees[axes[0]]) * rotation(axes[1], degrees[axes[1]]) *
                   rotation(axes[2], degrees[axes[2]]);
        });
    }
    return OpState::UnknownType;
}

void warn(const Prim& prim, const Attribute& where, const char* code, std::string message) {
    prim.diagnostics().warn(code, where.loc(), prim.path_string(), std::move(message));
}

/// Inverse by cofactors in scaled form is not needed: a singular op is reported and counts as
/// identity.
Mat4d inverted(const Prim& prim, const Attribute& attribute, const Mat4d& m) {
    const Mat4d result = m.inverse();
    const bool is_singular = m.determinant() == 0.0;
    if (!is_singular) return result;
    warn(prim, attribute, "usd-singular-xform-op",
         fmt::format("inverse of {} does not exist: the matrix is singular",
                     attribute.name().str()));
    return {};
}

/// The names that count: those after the last reset.
struct OpOrder {
    std::vector<std::string> names;
    bool resets = false;
};

OpOrder op_order(const Prim& prim) {
    OpOrder order;
    const auto authored = prim.attribute("xformOpOrder").get<std::vector<std::string>>();
    if (!authored) return order;
    order.names = *authored;
    const auto reset = std::find(order.names.rbegin(), order.names.rend(), reset_name);
    if (reset != order.names.rend()) {
        order.resets = true;
        order.names.erase(order.names.begin(), reset.base());
    }
    return order;
}

}  // namespace

bool is_xform_op(std::string_view name) {
    Mat4d m;
    return op_matrix(op_type(name), Attribute(), {}, m) != OpState::UnknownType;
}

std::optional<Mat4d> xform_op_matrix(Prim prim, const std::string& op_name, TimeCode time) {
    std::string_view name = op_name;
    const bool invert = name.starts_with(invert_prefix);
    if (invert) name.remove_prefix(invert_prefix.size());
    const std::string type = op_type(name);
    const Attribute attribute = prim.attribute(name);
    Mat4d m;
    const OpState state = op_matrix(type, attribute, time, m);
    if (state == OpState::UnknownType) {
        warn(prim, prim.attribute("xformOpOrder"), "usd-unknown-xform-op",
             fmt::format("unknown transform op \"{}\"; it is ignored", op_name));
        return std::nullopt;
    }
    if (state == OpState::WrongValue) {
        warn(prim, attribute, "usd-xform-op-type",
             fmt::format("value of {} has type {}, which op {} cannot use; it is ignored",
                         attribute.name().str(), attribute.type_name().str(), type));
    }
    return invert && state == OpState::Ok ? inverted(prim, attribute, m) : m;
}

LocalTransform local_transform(Prim prim, TimeCode time) {
    LocalTransform local;
    if (!prim || prim.is_pseudo_root()) return local;
    const OpOrder order = op_order(prim);
    local.resets_stack = order.resets;
    // The last op meets points first: with row vectors it stands leftmost
    for (size_t i = 0; i < order.names.size(); ++i) {
        // An op right before its own inverse cancels exactly
        if (i + 1 < order.names.size() &&
            order.names[i + 1] == std::string(invert_prefix) + order.names[i]) {
            ++i;
            continue;
        }
        if (const auto m = xform_op_matrix(prim, order.names[i], time))
            local.matrix = *m * local.matrix;
        std::string_view name = order.names[i];
        if (name.starts_with(invert_prefix)) name.remove_prefix(invert_prefix.size());
        local.might_be_varying =
            local.might_be_varying || prim.attribute(name).might_be_time_varying();
    }
    return local;
}

Mat4d world_transform(Prim prim, TimeCode time) {
    std::vector<Mat4d> chain;
    for (; prim && !prim.is_pseudo_root(); prim = prim.parent()) {
        const LocalTransform local = local_transform(prim, time);
        chain.push_back(local.matrix);
        if (local.resets_stack) break;
    }
    // From the root down, in the order in which a walk through the namespace multiplies: the same
    // rounding
    Mat4d world;
    for (auto it = chain.rbegin(); it != chain.rend(); ++it) world = *it * world;
    return world;
}

std::vector<double> transform_sample_times(Prim prim) {
    std::vector<double> times;
    for (std::string_view name : op_order(prim).names) {
        if (name.starts_with(invert_prefix)) name.remove_prefix(invert_prefix.size());
        const std::vector<double> own = prim.attribute(name).time_samples();
        times.insert(times.end(), own.begin(), own.end());
    }
    std::sort(times.begin(), times.end());
    times.erase(std::unique(times.begin(), times.end()), times.end());
    return times;
}

}  // namespace velatura::usd::stage
