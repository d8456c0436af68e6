// SPDX-License-Identifier: Apache-2.0
#include "usd/text/spline_text.h"

#include "usd/text/number_text.h"

#include <algorithm>
#include <array>
#include <string_view>

namespace velatura::usd::text {

namespace {

using layer::SplineCurve;
using layer::SplineExtrapolation;
using layer::SplineExtrapolationMode;
using layer::SplineInterpolation;
using layer::SplineKnot;
using layer::SplineLoop;
using layer::SplineTangent;
using layer::SplineTangentAlgorithm;
using layer::SplineType;
using layer::SplineValue;

constexpr std::array<std::string_view, 4> interpolations = {"none", "held", "linear", "curve"};
constexpr std::array<std::string_view, 3> algorithms = {"none", "custom", "autoEase"};
constexpr std::array<std::string_view, 7> extrapolations = {
    "none", "held", "linear", "sloped", "loop repeat", "loop reset", "loop oscillate"};

class SplineParser {
  public:
    SplineParser(Scanner& scanner, ValueParser& values, SplineValue& out)
        : s_(scanner), values_(values), out_(out) {}

    bool parse() {
        return values_.bracketed('{', '}', [&] { return item(); });
    }

  private:
    bool item() {
        if (s_.accept_word("bezier")) {
            out_.curve = SplineCurve::Bezier;
            return true;
        }
        if (s_.accept_word("hermite")) {
            out_.curve = SplineCurve::Hermite;
            return true;
        }
        if (s_.accept_word("pre")) return colon() && extrapolation(out_.pre);
        if (s_.accept_word("post")) return colon() && extrapolation(out_.post);
        if (s_.accept_word("loop")) return colon() && loop();
        if (s_.at_number()) return knot();
        return s_.fail("'bezier', 'hermite', 'pre', 'post', 'loop', the time of a knot or '}'");
    }

    bool colon() {
        s_.skip_inline();
        if (!s_.expect(':')) return false;
        s_.skip_inline();
        return true;
    }

    bool numbers(std::span<double> out) {
        if (!s_.expect('(')) return false;
        for (size_t i = 0; i < out.size(); ++i) {
            s_.skip_inline();
            if (i > 0 && !s_.expect(',')) return false;
            s_.skip_inline();
            if (!values_.element(out[i])) return false;
        }
        s_.skip_inline();
        return s_.expect(')');
    }

    bool extrapolation(SplineExtrapolation& out) {
        out = {};
        for (size_t i = 0; i < 3; ++i) {
            if (!s_.accept_word(extrapolations[i])) continue;
            out.mode = SplineExtrapolationMode(i);
            return true;
        }
        if (s_.accept_word("sloped")) {
            out.mode = SplineExtrapolationMode::Sloped;
            s_.skip_inline();
            return numbers({&out.slope, 1});
        }
        if (!s_.accept_word("loop")) {
            return s_.fail("'none', 'held', 'linear', 'sloped' or 'loop'");
        }
        s_.skip_inline();
        if (s_.accept_word("repeat")) {
            out.mode = SplineExtrapolationMode::LoopRepeat;
        } else if (s_.accept_word("reset")) {
            out.mode = SplineExtrapolationMode::LoopReset;
        } else if (s_.accept_word("oscillate")) {
            out.mode = SplineExtrapolationMode::LoopOscillate;
        } else {
            return s_.fail("'repeat', 'reset' or 'oscillate'");
        }
        return true;
    }

    bool loop() {
        std::array<double, 5> n{};
        const SourceLoc where = s_.loc();
        if (!numbers(n)) return false;
        const auto is_count = [](double v) { return v >= 0.0 && v <= 2147483647.0; };
        if (!is_count(n[2]) || !is_count(n[3])) {
            return s_.error("usd-value", where,
                            "found a loop with an invalid count, expected 0 or more");
        }
        out_.loop = SplineLoop{n[0], n[1], int32_t(n[2]), int32_t(n[3]), n[4]};
        return true;
    }

    /// A number rounded to the spline's type.
    bool value(double& out) {
        if (!values_.element(out)) return false;
        if (out_.type == SplineType::Float) out = double(float(out));
        if (out_.type == SplineType::Half) out = double(float(layer::Float16(float(out))));
        return true;
    }

    bool knot() {
        SplineKnot k;
        if (!values_.element(k.time) || !colon() || !value(k.value)) return false;
        s_.skip_inline();
        if (s_.accept('&')) {
            s_.skip_inline();
            k.is_dual = true;
            k.pre_value = k.value;
            if (!value(k.value)) return false;
            s_.skip_inline();
        }
        while (s_.accept(';')) {
            s_.skip_inline();
            if (!knot_parameter(k)) return false;
            s_.skip_inline();
        }
        out_.knots.push_back(std::move(k));
        return true;
    }

    bool knot_parameter(SplineKnot& k) {
        if (s_.peek() == '{') return values_.dictionary(k.custom_data);
        if (s_.accept_word("pre")) {
            s_.skip_inline();
            return tangent(k.pre);
        }
        if (!s_.accept_word("post")) return s_.fail("'pre', 'post' or '{'");
        s_.skip_inline();
        const auto* mode =
            std::find_if(interpolations.begin(), interpolations.end(),
                         [&](std::string_view word) { return s_.accept_word(word); });
        if (mode != interpolations.end()) {
            k.next = SplineInterpolation(mode - interpolations.begin());
            s_.skip_inline();
            return s_.peek() != '(' || tangent(k.post);
        }
        if (s_.peek() == '(') return tangent(k.post);
        return s_.fail("'none', 'held', 'linear' or 'curve'");
    }

    bool tangent(SplineTangent& out) {
        double first = 0.0;
        if (!s_.expect('(')) return false;
        s_.skip_inline();
        if (!values_.element(first)) return false;
        out.slope = first;
        bool has_width = false;
        s_.skip_inline();
        while (s_.accept(',')) {
            s_.skip_inline();
            if (s_.at_number() && !has_width) {
                out.width = first;
                has_width = true;
                if (!value(out.slope)) return false;
            } else {
                const auto* word =
                    std::find_if(algorithms.begin(), algorithms.end(),
                                 [&](std::string_view w) { return s_.accept_word(w); });
                if (word == algorithms.end()) return s_.fail("'custom', 'autoEase' or ')'");
                out.algorithm = SplineTangentAlgorithm(word - algorithms.begin());
            }
            s_.skip_inline();
        }
        return s_.expect(')');
    }

    Scanner& s_;
    ValueParser& values_;
    SplineValue& out_;
};

void append_typed(std::string& out, SplineType type, double v) {
    if (type == SplineType::Double) {
        append_number(out, v);
    } else {
        append_number(out, float(v));
    }
}

void append_tangent(std::string& out, const SplineValue& spline, const SplineTangent& t) {
    out += '(';
    if (spline.curve == SplineCurve::Bezier || t.width != 0.0) {
        append_number(out, t.width);
        out += ", ";
    }
    append_typed(out, spline.type, t.slope);
    if (t.algorithm != SplineTangentAlgorithm::None) {
        out.append(", ").append(algorithms[size_t(t.algorithm)]);
    }
    out += ')';
}

void append_extrapolation(std::string& out,
                          int indent,
                          std::string_view name,
                          const SplineExtrapolation& e) {
    if (e.mode == SplineExtrapolationMode::Held) return;
    out.append(size_t(indent) * 4, ' ').append(name).append(": ");
    out += extrapolations[size_t(e.mode)];
    if (e.mode == SplineExtrapolationMode::Sloped) {
        out += '(';
        append_number(out, e.slope);
        out += ')';
    }
    out += ",\n";
}

}  // namespace

bool parse_spline(Scanner& scanner, ValueParser& values, SplineValue& out) {
    return SplineParser(scanner, values, out).parse();
}

void append_spline_head(std::string& out, const SplineValue& spline, int indent) {
    const bool has_curves =
        std::any_of(spline.knots.begin(), spline.knots.end(),
                    [](const SplineKnot& k) { return k.next == SplineInterpolation::Curve; });
    if (has_curves || spline.curve == SplineCurve::Hermite) {
        out.append(size_t(indent) * 4, ' ');
        out += spline.curve == SplineCurve::Bezier ? "bezier,\n" : "hermite,\n";
    }
    append_extrapolation(out, indent, "pre", spline.pre);
    append_extrapolation(out, indent, "post", spline.post);
    if (spline.loop == SplineLoop()) return;
    out.append(size_t(indent) * 4, ' ').append("loop: (");
    append_number(out, spline.loop.start);
    out += ", ";
    append_number(out, spline.loop.end);
    out += ", " + std::to_string(spline.loop.pre_count);
    out += ", " + std::to_string(spline.loop.post_count) + ", ";
    append_number(out, spline.loop.value_offset);
    out += "),\n";
}

void append_knot(std::string& out, const SplineValue& spline, size_t i) {
    const SplineKnot& k = spline.knots[i];
    append_number(out, k.time);
    out += ": ";
    if (k.is_dual) {
        append_typed(out, spline.type, k.pre_value);
        out += " & ";
    }
    append_typed(out, spline.type, k.value);
    // Tangents of curves, and others that are not just left out
    const bool is_curve = k.next == SplineInterpolation::Curve;
    const bool is_after_curve =
        i == 0 ? is_curve : spline.knots[i - 1].next == SplineInterpolation::Curve;
    if (is_after_curve || k.pre != SplineTangent()) {
        out += "; pre ";
        append_tangent(out, spline, k.pre);
    }
    out.append("; post ").append(interpolations[size_t(k.next)]);
    if (is_curve || k.post != SplineTangent()) {
        out += ' ';
        append_tangent(out, spline, k.post);
    }
}

}  // namespace velatura::usd::text
