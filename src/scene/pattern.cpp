// SPDX-License-Identifier: Apache-2.0
#include "scene/pattern.h"

#include "scene/pattern_noise.h"

#include <algorithm>
#include <cmath>

namespace velatura::scene {

namespace {

using V = PatternValue;

template <class F>
V each(const V& a, F f) {
    return {f(a.x), f(a.y), f(a.z), f(a.w)};
}

template <class F>
V each(const V& a, const V& b, F f) {
    return {f(a.x, b.x), f(a.y, b.y), f(a.z, b.z), f(a.w, b.w)};
}

float divided(float a, float b) {
    return b != 0.0f ? a / b : 0.0f;
}

float modulo(float a, float b) {
    return b != 0.0f ? a - b * std::floor(a / b) : 0.0f;
}

float smoothstep(float x, float low, float high) {
    if (!(low < high)) return x >= high ? 1.0f : 0.0f;
    const float t = std::clamp((x - low) / (high - low), 0.0f, 1.0f);
    return t * t * (3.0f - 2.0f * t);
}

float decoded_srgb(float v) {
    return v <= 0.04045f ? v / 12.92f : std::pow((v + 0.055f) / 1.055f, 2.4f);
}

V dot(const V& a, const V& b, int width) {
    float sum = 0;
    for (int i = 0; i < width; ++i) sum += a[i] * b[i];
    return V(sum);
}

V swizzled(const V& a, uint32_t data) {
    const float from[6] = {a.x, a.y, a.z, a.w, 0.0f, 1.0f};
    V out;
    for (int i = 0; i < 4; ++i) out[i] = from[std::min(data >> (3 * i) & 7u, 5u)];
    return out;
}

V rotated2(const V& a, float degrees) {
    const float angle = degrees * (pi / 180.0f), c = std::cos(angle), s = std::sin(angle);
    return {c * a.x + s * a.y, c * a.y - s * a.x, 0.0f, 0.0f};
}

/// Rodrigues' formula; clockwise for who looks against the axis, as rotated2 turns.
V rotated3(const V& a, float degrees, const V& axis) {
    const Vec3 v(a.x, a.y, a.z), raw(axis.x, axis.y, axis.z);
    const float length = std::sqrt(raw.dot(raw));
    if (!(length > 0.0f)) return a;
    const Vec3 k = raw / length;
    const float angle = degrees * (pi / 180.0f), c = std::cos(angle), s = std::sin(angle);
    const Vec3 r = v * c + v.cross(k) * s + k * (k.dot(v) * (1.0f - c));
    return {r.x, r.y, r.z, 0.0f};
}

/// Hue, saturation and value in [0, 1]. Ref: Smith 1978, "Color Gamut Transform Pairs".
V hsv_from_rgb(const V& c) {
    const float max = std::max({c.x, c.y, c.z}), min = std::min({c.x, c.y, c.z});
    const float span = max - min;
    if (!(span > 0.0f)) return {0.0f, 0.0f, max, c.w};
    float h = 0;
    if (c.x >= max) {
        h = (c.y - c.z) / span;
    } else if (c.y >= max) {
        h = 2.0f + (c.z - c.x) / span;
    } else {
        h = 4.0f + (c.x - c.y) / span;
    }
    h /= 6.0f;
    return {h < 0.0f ? h + 1.0f : h, max > 0.0f ? span / max : 0.0f, max, c.w};
}

V rgb_from_hsv(const V& c) {
    if (!(c.y > 0.0f)) return {c.z, c.z, c.z, c.w};
    const float h = 6.0f * (c.x - std::floor(c.x));
    const float f = h - std::floor(h);
    const float p = c.z * (1.0f - c.y), q = c.z * (1.0f - c.y * f);
    const float t = c.z * (1.0f - c.y * (1.0f - f));
    switch (int(h)) {
        case 0:
            return {c.z, t, p, c.w};
        case 1:
            return {q, c.z, p, c.w};
        case 2:
            return {p, c.z, t, c.w};
        case 3:
            return {p, q, c.z, c.w};
        case 4:
            return {t, p, c.z, c.w};
        default:
            return {c.z, p, q, c.w};
    }
}

V padded(const Vec3& v) {
    return {v.x, v.y, v.z, 0.0f};
}

V noise_of(PatternOp op, const V& a, bool is_triple) {
    const Vec2 p2(a.x, a.y);
    const Vec3 p3(a.x, a.y, a.z);
    switch (op) {
        case PatternOp::Noise2:
            return is_triple ? padded(noise3(p2)) : V(noise(p2));
        case PatternOp::Noise3:
            return is_triple ? padded(noise3(p3)) : V(noise(p3));
        case PatternOp::CellNoise2:
            return is_triple ? padded(cell_noise3(p2)) : V(cell_noise(p2));
        default:
            return is_triple ? padded(cell_noise3(p3)) : V(cell_noise(p3));
    }
}

V fractal(const V* in, bool is_triple) {
    constexpr float max_octaves = 32.0f;
    const int octaves = int(std::clamp(in[1].x, 0.0f, max_octaves));
    V sum(0.0f), p = in[0];
    float amplitude = 1.0f;
    for (int i = 0; i < octaves; ++i) {
        sum += noise_of(PatternOp::Noise3, p, is_triple) * amplitude;
        amplitude *= in[3].x;
        p *= in[2].x;
    }
    return sum;
}

V across_channels(const PatternStep& step, const V* in) {
    switch (step.op) {
        case PatternOp::Dot:
            return dot(in[0], in[1], step.width);
        case PatternOp::Cross:
            return padded(Vec3(in[0].x, in[0].y, in[0].z).cross(Vec3(in[1].x, in[1].y, in[1].z)));
        case PatternOp::Swizzle:
            return swizzled(in[0], step.data);
        case PatternOp::Combine:
            return {in[0].x, in[1].x, in[2].x, in[3].x};
        case PatternOp::Rotate2:
            return rotated2(in[0], in[1].x);
        case PatternOp::Rotate3:
            return rotated3(in[0], in[1].x, in[2]);
        case PatternOp::HsvFromRgb:
            return hsv_from_rgb(in[0]);
        case PatternOp::RgbFromHsv:
            return rgb_from_hsv(in[0]);
        case PatternOp::Fractal3:
            return fractal(in, step.data != 0);
        default:
            return noise_of(step.op, in[0], step.data != 0);
    }
}

V of_one(PatternOp op, const V& a) {
    switch (op) {
        case PatternOp::Absolute:
            return each(a, [](float x) { return std::abs(x); });
        case PatternOp::Sign:
            return each(a, [](float x) { return x > 0.0f ? 1.0f : x < 0.0f ? -1.0f : 0.0f; });
        case PatternOp::Floor:
            return each(a, [](float x) { return std::floor(x); });
        case PatternOp::Ceiling:
            return each(a, [](float x) { return std::ceil(x); });
        case PatternOp::Round:
            return each(a, [](float x) { return std::round(x); });
        case PatternOp::SquareRoot:
            return each(a, [](float x) { return x > 0.0f ? std::sqrt(x) : 0.0f; });
        case PatternOp::Exponential:
            return each(a, [](float x) { return std::exp(x); });
        case PatternOp::Logarithm:
            return each(a, [](float x) { return x > 0.0f ? std::log(x) : 0.0f; });
        case PatternOp::Sine:
            return each(a, [](float x) { return std::sin(x); });
        case PatternOp::Cosine:
            return each(a, [](float x) { return std::cos(x); });
        case PatternOp::Tangent:
            return each(a, [](float x) { return std::tan(x); });
        case PatternOp::ArcSine:
            return each(a, [](float x) { return std::asin(std::clamp(x, -1.0f, 1.0f)); });
        case PatternOp::ArcCosine:
            return each(a, [](float x) { return std::acos(std::clamp(x, -1.0f, 1.0f)); });
        default:
            return each(a, decoded_srgb);
    }
}

}  // namespace

int input_count(PatternOp op) {
    switch (op) {
        case PatternOp::Constant:
        case PatternOp::Texture:
        case PatternOp::Position:
        case PatternOp::Normal:
            return 0;
        case PatternOp::Add:
        case PatternOp::Subtract:
        case PatternOp::Multiply:
        case PatternOp::Divide:
        case PatternOp::Modulo:
        case PatternOp::Power:
        case PatternOp::Minimum:
        case PatternOp::Maximum:
        case PatternOp::ArcTangent:
        case PatternOp::Dot:
        case PatternOp::Cross:
        case PatternOp::Rotate2:
            return 2;
        case PatternOp::Mix:
        case PatternOp::Smoothstep:
        case PatternOp::Rotate3:
            return 3;
        case PatternOp::IfGreater:
        case PatternOp::IfGreaterOrEqual:
        case PatternOp::IfEqual:
        case PatternOp::Combine:
        case PatternOp::Fractal3:
            return 4;
        default:
            return 1;
    }
}

PatternValue result_of(const PatternStep& step, const PatternValue* in) {
    switch (step.op) {
        case PatternOp::Add:
            return in[0] + in[1];
        case PatternOp::Subtract:
            return in[0] - in[1];
        case PatternOp::Multiply:
            return in[0] * in[1];
        case PatternOp::Divide:
            return each(in[0], in[1], divided);
        case PatternOp::Modulo:
            return each(in[0], in[1], modulo);
        case PatternOp::Power:
            return each(in[0], in[1], [](float a, float b) {
                return std::copysign(std::pow(std::abs(a), b), a);
            });
        case PatternOp::Minimum:
            return each(in[0], in[1], [](float a, float b) { return std::min(a, b); });
        case PatternOp::Maximum:
            return each(in[0], in[1], [](float a, float b) { return std::max(a, b); });
        case PatternOp::ArcTangent:
            return each(in[0], in[1], [](float a, float b) { return std::atan2(a, b); });
        case PatternOp::Mix:
            return in[0] + (in[1] - in[0]) * in[2];
        case PatternOp::Smoothstep:
            return {smoothstep(in[0].x, in[1].x, in[2].x), smoothstep(in[0].y, in[1].y, in[2].y),
                    smoothstep(in[0].z, in[1].z, in[2].z), smoothstep(in[0].w, in[1].w, in[2].w)};
        case PatternOp::IfGreater:
            return in[0].x > in[1].x ? in[2] : in[3];
        case PatternOp::IfGreaterOrEqual:
            return in[0].x >= in[1].x ? in[2] : in[3];
        case PatternOp::IfEqual:
            return in[0].x == in[1].x ? in[2] : in[3];
        default:
            break;
    }
    const bool is_across = step.op >= PatternOp::Dot;
    return is_across ? across_channels(step, in) : of_one(step.op, in[0]);
}

}  // namespace velatura::scene
