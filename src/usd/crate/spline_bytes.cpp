// SPDX-License-Identifier: Apache-2.0
#include "usd/crate/spline_bytes.h"

#include "usd/crate/append.h"

#include <algorithm>
#include <bit>
#include <unordered_map>

namespace velatura::usd::crate {

using layer::SplineCurve;
using layer::SplineExtrapolation;
using layer::SplineExtrapolationMode;
using layer::SplineInterpolation;
using layer::SplineKnot;
using layer::SplineTangentAlgorithm;
using layer::SplineType;
using layer::SplineValue;

namespace {

constexpr unsigned newest_spline_version = 2;
constexpr uint64_t min_knot_size = 1 + 8 + 3 * 2;

double read_number(Cursor& c, SplineType type) {
    if (type == SplineType::Double) return c.read<double>();
    if (type == SplineType::Float) return double(c.read<float>());
    return double(float(c.read<layer::Float16>()));
}

void append_number(std::string& out, SplineType type, double v) {
    if (type == SplineType::Double) append(out, v);
    if (type == SplineType::Float) append(out, float(v));
    if (type == SplineType::Half) append(out, layer::Float16(float(v)).bits());
}

bool read_mode(Cursor& c, unsigned bits, SplineExtrapolation& out) {
    if (bits > unsigned(SplineExtrapolationMode::LoopOscillate)) {
        return c.fail("extrapolation mode 7 of a spline", "0 to 6");
    }
    out.mode = SplineExtrapolationMode(bits);
    return true;
}

bool read_algorithm(Cursor& c, unsigned bits, SplineTangentAlgorithm& out) {
    if (bits > unsigned(SplineTangentAlgorithm::AutoEase)) {
        return c.fail("an unknown tangent algorithm of a spline", "0 to 2");
    }
    out = SplineTangentAlgorithm(bits);
    return true;
}

void read_knot(Cursor& c, unsigned version, const SplineValue& spline, SplineKnot& k) {
    const unsigned flags = c.read<uint8_t>();
    k.is_dual = (flags & 1) != 0;
    k.next = SplineInterpolation((flags >> 1) & 3);
    k.time = c.read<double>();
    k.value = read_number(c, spline.type);
    if (k.is_dual) k.pre_value = read_number(c, spline.type);
    if (spline.curve == SplineCurve::Bezier) {
        k.pre.width = c.read<double>();
        k.post.width = c.read<double>();
    }
    k.pre.slope = read_number(c, spline.type);
    k.post.slope = read_number(c, spline.type);
    if (version >= 2) {
        const unsigned bits = c.read<uint8_t>();
        read_algorithm(c, bits & 15, k.pre.algorithm);
        read_algorithm(c, bits >> 4, k.post.algorithm);
    }
}

void read_head(Cursor& c, SplineValue& out) {
    const unsigned modes = c.read<uint8_t>();
    read_mode(c, modes & 7, out.pre);
    read_mode(c, (modes >> 3) & 7, out.post);
    if (out.pre.mode == SplineExtrapolationMode::Sloped) out.pre.slope = c.read<double>();
    if (out.post.mode == SplineExtrapolationMode::Sloped) out.post.slope = c.read<double>();
    if ((modes & 64) != 0) {
        out.loop.start = c.read<double>();
        out.loop.end = c.read<double>();
        out.loop.pre_count = c.read<int32_t>();
        out.loop.post_count = c.read<int32_t>();
        out.loop.value_offset = c.read<double>();
    }
}

}  // namespace

bool decode_spline(std::string_view blob,
                   KnotData custom_data,
                   SplineValue& out,
                   Problem& problem) {
    out = {};
    if (blob.empty()) return true;
    Cursor c(blob);
    const unsigned head = c.read<uint8_t>();
    const unsigned version = head & 15;
    if (version == 0 || version > newest_spline_version) {
        c.fail_at(0, "version " + std::to_string(version) + " of a spline", "1 or 2");
    }
    const unsigned type = (head >> 4) & 3;
    out.type = type == 2 ? SplineType::Float : type == 3 ? SplineType::Half : SplineType::Double;
    out.is_time_valued = (head & 64) != 0;
    out.curve = (head & 128) != 0 ? SplineCurve::Hermite : SplineCurve::Bezier;
    read_head(c, out);
    // A spline of no type has no knots, and may leave out that there are none
    if (c.left() > 0) {
        const uint64_t at = c.at();
        const uint64_t n = c.read<uint32_t>();
        if (n > c.left() / min_knot_size) {
            c.fail_at(at, std::to_string(n) + " knots of a spline", "no more than there are");
        }
        if (c.ok()) out.knots.resize(n);
        for (SplineKnot& k : out.knots) read_knot(c, version, out, k);
    }
    if (c.left() > 0) c.fail("bytes after the last knot of a spline", "none");
    if (!c.ok()) {
        problem = c.problem();
        return false;
    }
    // By the bits of the times, as some may be no number
    std::unordered_map<uint64_t, size_t> knots;
    for (size_t i = 0; i < out.knots.size(); ++i) {
        knots.emplace(std::bit_cast<uint64_t>(out.knots[i].time), i);
    }
    for (auto& [time, data] : custom_data) {
        const auto knot = knots.find(std::bit_cast<uint64_t>(time));
        if (knot != knots.end()) out.knots[knot->second].custom_data = std::move(data);
    }
    return true;
}

bool has_tangent_algorithms(const SplineValue& spline) {
    return std::any_of(spline.knots.begin(), spline.knots.end(), [](const SplineKnot& k) {
        return k.pre.algorithm != SplineTangentAlgorithm::None ||
               k.post.algorithm != SplineTangentAlgorithm::None;
    });
}

std::string encode_spline(const SplineValue& spline) {
    std::string out;
    const bool has_algorithms = has_tangent_algorithms(spline);
    const unsigned type = spline.type == SplineType::Double  ? 1
                          : spline.type == SplineType::Float ? 2
                                                             : 3;
    const unsigned curve = spline.curve == SplineCurve::Hermite ? 1 : 0;
    const bool has_loop = spline.loop != layer::SplineLoop();
    out += char((has_algorithms ? 2u : 1u) | type << 4 | unsigned(spline.is_time_valued) << 6 |
                curve << 7);
    out +=
        char(unsigned(spline.pre.mode) | unsigned(spline.post.mode) << 3 | unsigned(has_loop) << 6);
    if (spline.pre.mode == SplineExtrapolationMode::Sloped) append(out, spline.pre.slope);
    if (spline.post.mode == SplineExtrapolationMode::Sloped) append(out, spline.post.slope);
    if (has_loop) {
        append(out, spline.loop.start);
        append(out, spline.loop.end);
        append(out, spline.loop.pre_count);
        append(out, spline.loop.post_count);
        append(out, spline.loop.value_offset);
    }
    append(out, uint32_t(spline.knots.size()));
    for (const SplineKnot& k : spline.knots) {
        out += char(unsigned(k.is_dual) | unsigned(k.next) << 1 | curve << 3);
        append(out, k.time);
        append_number(out, spline.type, k.value);
        if (k.is_dual) append_number(out, spline.type, k.pre_value);
        if (spline.curve == SplineCurve::Bezier) {
            append(out, k.pre.width);
            append(out, k.post.width);
        }
        append_number(out, spline.type, k.pre.slope);
        append_number(out, spline.type, k.post.slope);
        if (has_algorithms) {
            out += char(unsigned(k.pre.algorithm) | unsigned(k.post.algorithm) << 4);
        }
    }
    return out;
}

}  // namespace velatura::usd::crate
