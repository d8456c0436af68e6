// SPDX-License-Identifier: Apache-2.0
#include "translate/materials/pattern_builder.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace velatura::translate::materials {

using scene::PatternOp;
using scene::PatternStep;
using scene::PatternValue;

namespace {

/// Steps beyond which a graph is not built on; far more than scene::max_pattern_steps.
constexpr size_t max_steps = 0xfff0;

bool is_equal(const PatternValue& v, float number, int width) {
    for (int i = 0; i < width; ++i) {
        if (v[i] != number) return false;
    }
    return true;
}

}  // namespace

Map2 rotation_map(double degrees) {
    double cosine = std::cos(degrees * pi_d / 180), sine = std::sin(degrees * pi_d / 180);
    const double quarters = degrees / 90.0;
    if (std::isfinite(quarters) && quarters == std::floor(quarters)) {
        const int turn = int(std::fmod(std::fmod(quarters, 4.0) + 4.0, 4.0));
        cosine = turn == 0 ? 1 : turn == 2 ? -1 : 0;
        sine = turn == 1 ? 1 : turn == 3 ? -1 : 0;
    }
    return {cosine, sine, -sine, cosine, 0, 0};
}

Port PatternBuilder::add_step(const PatternStep& step, int width) {
    const Key key(uint8_t(step.op), step.width, step.in[0], step.in[1], step.in[2], step.in[3],
                  step.data);
    const auto [it, is_new] = known_.try_emplace(key, uint16_t(steps_.size()));
    const Port made{it->second, uint8_t(width)};
    if (!is_new) return made;
    if (steps_.size() >= max_steps) {
        known_.erase(it);
        is_full_ = true;
        return {0, uint8_t(width)};
    }
    steps_.push_back(step);
    affine_.emplace_back();
    follow_coordinates(step, made);
    return made;
}

Port PatternBuilder::constant(const PatternValue& value, int width) {
    const PatternValue full = width == 1 ? PatternValue(value.x) : value;
    std::array<uint32_t, 4> bits;
    for (int i = 0; i < 4; ++i) bits[size_t(i)] = std::bit_cast<uint32_t>(full[i]);
    const auto [it, is_new] = known_constants_.try_emplace(bits, uint32_t(constants_.size()));
    if (is_new) constants_.push_back(full);
    return add_step({PatternOp::Constant, 4, {0, 0, 0, 0}, it->second}, width);
}

Port PatternBuilder::texture(scene::TextureId id) {
    return add_step({PatternOp::Texture, 4, {0, 0, 0, 0}, id}, 4);
}

Port PatternBuilder::texture_at(scene::TextureId id, Port coordinates) {
    return add_step({PatternOp::TextureAt, 4, {coordinates.step, 0, 0, 0}, id}, 4);
}

Port PatternBuilder::primvar(scene::PrimvarId id, Port fallback) {
    return add_step({PatternOp::Primvar, fallback.width, {fallback.step, 0, 0, 0}, id},
                    fallback.width);
}

Port PatternBuilder::position(bool in_shape_space) {
    return add_step({PatternOp::Position, 3, {0, 0, 0, 0}, in_shape_space ? 1u : 0u}, 3);
}

Port PatternBuilder::normal() {
    return add_step({PatternOp::Normal, 3, {0, 0, 0, 0}, 0}, 3);
}

const PatternValue* PatternBuilder::constant_value(Port p) const {
    const PatternStep& step = steps_[p.step];
    return step.op == PatternOp::Constant ? &constants_[step.data] : nullptr;
}

bool PatternBuilder::is_constant(Port p, float value) const {
    const PatternValue* v = constant_value(p);
    return v != nullptr && is_equal(*v, value, p.width);
}

/// The port where it only has to stand in more channels.
Port PatternBuilder::widened(Port p, int width) {
    if (p.width == width || p.width != 1) return p;
    if (const PatternValue* v = constant_value(p)) return constant(*v, width);
    return {p.step, uint8_t(width)};
}

/// What the operation gives without being done; nothing when it has to be.
std::optional<Port> PatternBuilder::simplified(PatternOp op,
                                               int width,
                                               const std::vector<Port>& in) {
    switch (op) {
        case PatternOp::Add:
            if (is_constant(in[0], 0.0f)) return widened(in[1], width);
            if (is_constant(in[1], 0.0f)) return widened(in[0], width);
            break;
        case PatternOp::Subtract:
            if (is_constant(in[1], 0.0f)) return widened(in[0], width);
            break;
        case PatternOp::Multiply:
            if (is_constant(in[0], 1.0f)) return widened(in[1], width);
            if (is_constant(in[1], 1.0f)) return widened(in[0], width);
            if (is_constant(in[0], 0.0f) || is_constant(in[1], 0.0f))
                return constant(PatternValue(0.0f), width);
            break;
        case PatternOp::Divide:
        case PatternOp::Power:
            if (is_constant(in[1], 1.0f)) return widened(in[0], width);
            break;
        case PatternOp::Mix:
            if (is_constant(in[2], 0.0f)) return widened(in[0], width);
            if (is_constant(in[2], 1.0f)) return widened(in[1], width);
            if (in[0].step == in[1].step) return widened(in[0], width);
            break;
        default:
            break;
    }
    return std::nullopt;
}

Port PatternBuilder::apply(PatternOp op, int width, std::initializer_list<Port> in, uint32_t data) {
    const std::vector<Port> ports(in);
    // Of a dot product the width says how many channels go in
    const int step_width = op == PatternOp::Dot ? std::max(ports[0].width, ports[1].width) : width;
    PatternStep step{op, uint8_t(step_width), {0, 0, 0, 0}, data};
    PatternValue values[4];
    bool is_known = true;
    for (size_t i = 0; i < ports.size(); ++i) {
        step.in[i] = ports[i].step;
        const PatternValue* v = constant_value(ports[i]);
        is_known = is_known && v != nullptr;
        if (v != nullptr) values[i] = *v;
    }
    if (is_known) return constant(scene::result_of(step, values), width);
    if (const auto simple = simplified(op, width, ports)) return *simple;
    return add_step(step, width);
}

Port PatternBuilder::add(Port a, Port b) {
    return apply(PatternOp::Add, std::max(a.width, b.width), {a, b});
}

Port PatternBuilder::subtract(Port a, Port b) {
    return apply(PatternOp::Subtract, std::max(a.width, b.width), {a, b});
}

Port PatternBuilder::multiply(Port a, Port b) {
    return apply(PatternOp::Multiply, std::max(a.width, b.width), {a, b});
}

Port PatternBuilder::divide(Port a, Port b) {
    return apply(PatternOp::Divide, std::max(a.width, b.width), {a, b});
}

Port PatternBuilder::mix(Port from, Port to, Port share) {
    return apply(PatternOp::Mix, std::max({from.width, to.width, share.width}), {from, to, share});
}

Port PatternBuilder::clamp(Port a, Port low, Port high) {
    const Port above = apply(PatternOp::Maximum, std::max(a.width, low.width), {a, low});
    return apply(PatternOp::Minimum, std::max(above.width, high.width), {above, high});
}

Port PatternBuilder::dot(Port a, Port b) {
    return apply(PatternOp::Dot, 1, {a, b});
}

Port PatternBuilder::swizzle(Port a, int width, uint32_t x, uint32_t y, uint32_t z, uint32_t w) {
    // A number stands in all channels already
    if (a.width == 1 && width == 1) return a;
    const bool keeps = width == a.width && x == 0 && (width < 2 || y == 1) &&
                       (width < 3 || z == 2) && (width < 4 || w == 3);
    if (keeps) return a;
    return apply(PatternOp::Swizzle, width, {a}, scene::swizzle_data(x, y, z, w));
}

/// Notes steps that move, scale and turn the coordinates that a primvar holds.
void PatternBuilder::follow_coordinates(const PatternStep& step, Port made) {
    std::optional<AffineCoordinates>& out = affine_[made.step];
    if (step.op == PatternOp::Primvar && step.width == 2) {
        const PatternStep& fallback = steps_[step.in[0]];
        if (fallback.op != PatternOp::Constant) return;
        const PatternValue& v = constants_[fallback.data];
        out = AffineCoordinates{step.data, Vec2(v.x, v.y)};
    }
    const bool has_two = step.op == PatternOp::Add || step.op == PatternOp::Subtract ||
                         step.op == PatternOp::Multiply || step.op == PatternOp::Divide ||
                         step.op == PatternOp::Rotate2;
    if (!has_two) return;
    const bool is_first = affine_[step.in[0]].has_value();
    const bool can_swap = step.op == PatternOp::Add || step.op == PatternOp::Multiply;
    const auto& source = affine_[step.in[is_first || !can_swap ? 0 : 1]];
    const PatternStep& other = steps_[step.in[is_first || !can_swap ? 1 : 0]];
    if (!source || other.op != PatternOp::Constant) return;
    const double x = double(constants_[other.data].x), y = double(constants_[other.data].y);
    Map2 next;
    switch (step.op) {
        case PatternOp::Add:
            next = {1, 0, 0, 1, x, y};
            break;
        case PatternOp::Subtract:
            next = {1, 0, 0, 1, -x, -y};
            break;
        case PatternOp::Multiply:
            next = {x, 0, 0, y, 0, 0};
            break;
        case PatternOp::Divide:
            if (x == 0.0 || y == 0.0) return;
            next = {1 / x, 0, 0, 1 / y, 0, 0};
            break;
        default:
            next = rotation_map(-x);
            break;
    }
    out = AffineCoordinates{source->st, source->fallback, source->map.then(next)};
}

std::optional<AffineCoordinates> PatternBuilder::affine(Port p) const {
    return affine_[p.step];
}

std::optional<scene::TextureId> PatternBuilder::whole_texture(Port p) const {
    const PatternStep& step = steps_[p.step];
    if (step.op != PatternOp::Texture || p.width < 3) return std::nullopt;
    return step.data;
}

std::optional<scene::Input> PatternBuilder::input(Port p, const Rgb& varying_value) {
    using Source = scene::Input::Source;
    if (is_full_) return std::nullopt;
    scene::Input out(varying_value);
    const PatternStep& root = steps_[p.step];
    // What UsdPreviewSurface could have said takes the way of UsdPreviewSurface
    if (const PatternValue* v = constant_value(p)) {
        out.value = Rgb(v->x, v->y, v->z);
        return out;
    }
    if (whole_texture(p)) {
        out.source = Source::Texture;
        out.texture = root.data;
        return out;
    }
    if (root.op == PatternOp::Swizzle && steps_[root.in[0]].op == PatternOp::Texture) {
        for (uint32_t c = 0; c < 4; ++c) {
            if (root.data != scene::swizzle_data(c, c, c, c)) continue;
            out.source = Source::Texture;
            out.texture = steps_[root.in[0]].data;
            out.output = scene::TextureOutput(uint8_t(scene::TextureOutput::R) + c);
            return out;
        }
    }
    if (root.op == PatternOp::Primvar && (p.width == 1 || p.width == 3)) {
        const PatternStep& fallback = steps_[root.in[0]];
        if (fallback.op == PatternOp::Constant) {
            const PatternValue& v = constants_[fallback.data];
            out.value = Rgb(v.x, v.y, v.z);
            out.source = Source::Primvar;
            out.primvar = root.data;
            return out;
        }
    }

    // Keep what the result depends on, in order
    std::vector<bool> is_needed(steps_.size(), false);
    is_needed[p.step] = true;
    for (size_t i = size_t(p.step) + 1; i-- > 0;) {
        if (!is_needed[i]) continue;
        for (int k = 0; k < scene::input_count(steps_[i].op); ++k)
            is_needed[steps_[i].in[k]] = true;
    }
    scene::Pattern pattern;
    std::vector<uint16_t> new_place(steps_.size(), 0);
    for (size_t i = 0; i <= p.step; ++i) {
        if (!is_needed[i]) continue;
        PatternStep step = steps_[i];
        for (int k = 0; k < scene::input_count(step.op); ++k) step.in[k] = new_place[step.in[k]];
        if (step.op == PatternOp::Constant) {
            pattern.constants.push_back(constants_[step.data]);
            step.data = uint32_t(pattern.constants.size() - 1);
        }
        new_place[i] = uint16_t(pattern.steps.size());
        pattern.steps.push_back(step);
    }
    if (pattern.steps.size() > scene::max_pattern_steps) return std::nullopt;
    out.source = Source::Pattern;
    out.pattern = scene::PatternId(scene_.patterns.size());
    scene_.patterns.push_back(std::move(pattern));
    return out;
}

}  // namespace velatura::translate::materials
