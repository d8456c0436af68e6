// SPDX-License-Identifier: Apache-2.0
#include "compositor/look/controls.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace velatura::compositor {
inline namespace look {

namespace {

constexpr std::array<const char*, 8> kind_names = {"gain", "tint",   "kelvin", "mute",
                                                   "solo", "shadow", "caster", "clamp"};

template <class T>
bool parse_number(std::string_view text, T& value) {
    // from_chars takes no leading plus
    if (!text.empty() && text.front() == '+') text.remove_prefix(1);
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc() && end == text.data() + text.size() && std::isfinite(value);
}

Error bad(const std::string& text, const std::string& expected) {
    return {"bad-gain", fmt::format("cannot parse '{}'; expected {}", text, expected)};
}

Result<std::array<float, 3>> parse_tint(const std::string& text) {
    std::array<float, 3> tint{};
    std::string_view rest = text;
    for (size_t c = 0; c < 3; ++c) {
        const size_t comma = rest.find(',');
        const bool is_last = c == 2;
        const bool is_good = (comma == std::string_view::npos) == is_last &&
                             parse_number(rest.substr(0, comma), tint[c]) && tint[c] >= 0.0f &&
                             tint[c] <= largest_factor;
        if (!is_good)
            return bad(text, "a tint R,G,B of numbers from 0 to 64 stops, for example 1,.9,.8");
        if (!is_last) rest.remove_prefix(comma + 1);
    }
    return tint;
}

std::array<double, 3> planckian_rec709(double kelvin) {
    const double t = 1000.0 / kelvin;
    const double x = kelvin < 4000.0
                         ? ((-0.2661239 * t - 0.2343589) * t + 0.8776956) * t + 0.179910
                         : ((-3.0258469 * t + 2.1070379) * t + 0.2226347) * t + 0.240390;
    double y = 0;
    if (kelvin < 2222.0) {
        y = ((-1.1063814 * x - 1.34811020) * x + 2.18555832) * x - 0.20219683;
    } else if (kelvin < 4000.0) {
        y = ((-0.9549476 * x - 1.37418593) * x + 2.09137015) * x - 0.16748867;
    } else {
        y = ((3.0817580 * x - 5.87338670) * x + 3.75112997) * x - 0.37001483;
    }
    const double X = x / y, Z = (1.0 - x - y) / y;
    return {3.2404542 * X - 1.5371385 - 0.4985314 * Z, -0.9692660 * X + 1.8760108 + 0.0415560 * Z,
            0.0556434 * X - 0.2040259 + 1.0572252 * Z};
}

/// Against 6504 K, of luminance 1.
std::array<double, 3> relative_to_white(std::array<double, 3> rgb) {
    const auto white = planckian_rec709(6504.0);
    for (size_t c = 0; c < 3; ++c) rgb[c] /= white[c];
    const double luminance = 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
    for (double& v : rgb) v /= luminance;
    return rgb;
}

}  // namespace

std::array<float, 3> kelvin_tint(float kelvin) {
    auto rgb = planckian_rec709(double(kelvin));
    for (double& v : rgb) v = std::max(0.0, v);
    rgb = relative_to_white(rgb);
    return {float(rgb[0]), float(rgb[1]), float(rgb[2])};
}

std::array<float, 3> kelvin_tint(float kelvin, const image::ColorMatrix& m) {
    if (m == image::ColorMatrix{1, 0, 0, 0, 1, 0, 0, 0, 1}) return kelvin_tint(kelvin);
    // A wider gamut may hold what Rec.709 has to cut
    const auto rgb = relative_to_white(planckian_rec709(double(kelvin)));
    std::array<float, 3> tint{};
    for (size_t c = 0; c < 3; ++c)
        tint[c] =
            float(std::max(0.0, m[3 * c] * rgb[0] + m[3 * c + 1] * rgb[1] + m[3 * c + 2] * rgb[2]));
    return tint;
}

Result<float> parse_gain(const std::string& text) {
    constexpr const char* expected =
        "a factor from 0 (2, 0.5) or stops (+1.5st, -1st), of 64 stops at most";
    float value = 0;
    if (text.ends_with("st")) {
        if (!parse_number(std::string_view(text).substr(0, text.size() - 2), value) ||
            std::abs(value) > largest_stops)
            return bad(text, expected);
        return std::exp2(value);
    }
    // Where a sign means stops, a number with a sign and without `st` may mean either
    const bool is_signed = text.starts_with('+') || text.starts_with('-');
    if (is_signed && parse_number(text, value))
        return Error{"bad-gain",
                     fmt::format("'{0}' is ambiguous: {0}st is a gain in stops, {1:g} a factor",
                                 text, std::abs(value))};
    if (!parse_number(text, value) || value < 0.0f || value > largest_factor)
        return bad(text, expected);
    return value;
}

namespace {

/// A value in the numbers that keys are interpolated in.
struct Numbers {
    std::array<float, 3> of{};
    bool are_stops = false;
};

Result<Numbers> parse_value(Control::Kind kind, const std::string& text) {
    using Kind = Control::Kind;
    Numbers numbers;
    if (kind == Kind::Gain) {
        const auto gain = parse_gain(text);
        if (!gain) return gain.error();
        numbers.are_stops = text.ends_with("st");
        float stops = 0;
        if (numbers.are_stops)
            parse_number(std::string_view(text).substr(0, text.size() - 2), stops);
        numbers.of.fill(numbers.are_stops ? stops : *gain);
        return numbers;
    }
    if (kind == Kind::Tint) {
        const auto tint = parse_tint(text);
        if (!tint) return tint.error();
        numbers.of = *tint;
        return numbers;
    }
    float value = 0;
    const bool is_number = parse_number(text, value);
    if (kind == Kind::Kelvin) {
        if (!is_number || value < 1667.0f || value > 25000.0f)
            return bad(text, "a color temperature from 1667 to 25000");
    } else if (!is_number || value < 0.0f || value > 1.0f) {
        return bad(text, kind == Kind::Clamp
                             ? "a factor from 0 (as rendered) to 1 (undo the clamp)"
                             : "a shadow lift from 0 (as rendered) to 1 (no shadow)");
    }
    numbers.of.fill(value);
    return numbers;
}

std::array<float, 3> factor_of(Control::Kind kind, const Numbers& numbers) {
    if (kind == Control::Kind::Kelvin) return kelvin_tint(numbers.of[0]);
    std::array<float, 3> factor = numbers.of;
    if (numbers.are_stops) factor.fill(std::exp2(numbers.of[0]));
    return factor;
}

/// `1@1,2@24` as texts and frames: a value may hold commas, the number after an @ does not.
Result<std::vector<std::pair<double, std::string>>> split_keys(const std::string& text) {
    std::vector<std::pair<double, std::string>> keys;
    std::string_view rest = text;
    while (!rest.empty()) {
        const size_t at = rest.find('@');
        if (at == std::string_view::npos) return bad(text, "VALUE@FRAME,VALUE@FRAME");
        const size_t end = std::min(rest.find(',', at), rest.size());
        double frame = 0;
        if (!parse_number(rest.substr(at + 1, end - at - 1), frame))
            return bad(text, "a frame number after @");
        keys.emplace_back(frame, rest.substr(0, at));
        rest.remove_prefix(std::min(end + 1, rest.size()));
    }
    std::stable_sort(keys.begin(), keys.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    for (size_t i = 1; i < keys.size(); ++i) {
        if (keys[i].first == keys[i - 1].first) return bad(text, "one value per frame");
    }
    return keys;
}

Result<void> parse_keys(Control& control) {
    const auto keys = split_keys(control.value);
    if (!keys) return keys.error();
    std::vector<Numbers> numbers;
    for (const auto& [frame, text] : *keys) {
        const auto value = parse_value(control.kind, text);
        if (!value) return value.error();
        numbers.push_back(*value);
    }
    control.keys_are_stops =
        std::all_of(numbers.begin(), numbers.end(), [](const Numbers& n) { return n.are_stops; });
    for (size_t i = 0; i < numbers.size(); ++i) {
        if (!control.keys_are_stops && numbers[i].are_stops)
            numbers[i].of = factor_of(control.kind, numbers[i]);
        control.keys.push_back({(*keys)[i].first, numbers[i].of});
    }
    return {};
}

Numbers numbers_at(const Control& control, double frame) {
    const std::vector<Keyframe>& keys = control.keys;
    const auto after =
        std::find_if(keys.begin(), keys.end(), [&](const Keyframe& k) { return k.frame > frame; });
    Numbers numbers;
    numbers.are_stops = control.keys_are_stops;
    if (after == keys.begin() || after == keys.end()) {
        numbers.of = after == keys.begin() ? keys.front().numbers : keys.back().numbers;
        return numbers;
    }
    const Keyframe& before = *(after - 1);
    const double t = (frame - before.frame) / (after->frame - before.frame);
    for (size_t c = 0; c < 3; ++c) {
        numbers.of[c] = float(double(before.numbers[c]) +
                              t * (double(after->numbers[c]) - double(before.numbers[c])));
    }
    return numbers;
}

void set_factor(Control& control, const Numbers& numbers) {
    control.factor = factor_of(control.kind, numbers);
    if (control.kind == Control::Kind::Kelvin) control.kelvin = numbers.of[0];
}

}  // namespace

const char* name_of(Control::Kind kind) {
    return kind_names[size_t(kind)];
}

Result<Control> parse_control(Control::Kind kind, const std::string& text) {
    const bool has_value = kind != Control::Kind::Mute && kind != Control::Kind::Solo;
    // No value holds one, a name may
    const size_t equals = has_value ? text.rfind('=') : std::string::npos;
    if (text.empty() || equals == 0 || (equals != std::string::npos) != has_value)
        return bad(text, has_value ? "NAME=VALUE" : "NAME");
    return make_control(kind, text.substr(0, equals), has_value ? text.substr(equals + 1) : "");
}

Result<Control> make_control(Control::Kind kind,
                             const std::string& target,
                             const std::string& value) {
    Control control;
    control.kind = kind;
    control.target = target;
    control.value = value;
    const bool has_value = kind != Control::Kind::Mute && kind != Control::Kind::Solo;
    if (target.empty() || value.empty() == has_value)
        return bad(target + "=" + value, has_value ? "NAME=VALUE" : "NAME");
    if (kind == Control::Kind::Caster && target.find(':') == std::string::npos)
        return bad(target, "GROUP:CASTER=X");
    if (!has_value) return control;
    if (value.find('@') != std::string::npos) {
        if (auto parsed = parse_keys(control); !parsed) return parsed.error();
        set_factor(control, numbers_at(control, control.keys.front().frame));
        return control;
    }
    const auto numbers = parse_value(kind, value);
    if (!numbers) return numbers.error();
    set_factor(control, *numbers);
    return control;
}

std::vector<std::string> split_at_commas(std::string_view text) {
    std::vector<std::string> pieces(1);
    for (size_t i = 0; i < text.size(); ++i) {
        const bool is_escaped = text[i] == '\\' && text.substr(i + 1).starts_with(',');
        if (text[i] == ',') {
            pieces.emplace_back();
        } else {
            pieces.back() += is_escaped ? text[++i] : text[i];
        }
    }
    return pieces;
}

Result<void> add_rows(Look& look, const std::string& text) {
    const size_t equals = text.find('=');
    if (equals == 0 || equals == std::string::npos) return bad(text, "NAME=ROW,ROW");
    return add_rows(look, text.substr(0, equals),
                    split_at_commas(std::string_view(text).substr(equals + 1)));
}

Result<void> add_rows(Look& look, const std::string& name, std::vector<std::string> rows) {
    constexpr std::array words = {"all", "direct", "indirect", "tail", "env", "shadow"};
    const bool is_word = std::find(words.begin(), words.end(), name) != words.end();
    if (is_word || name.find(':') != std::string::npos)
        return bad(name, "a name for the group of rows");
    const bool has_gap =
        std::any_of(rows.begin(), rows.end(), [](const std::string& r) { return r.empty(); });
    if (name.empty() || rows.empty() || has_gap) return bad(name + "=", "NAME=ROW,ROW");
    look.rows[name] = std::move(rows);
    return {};
}

bool has_keys(const Look& look) {
    return std::any_of(look.controls.begin(), look.controls.end(),
                       [](const Control& c) { return !c.keys.empty(); });
}

Look look_at(Look look, double frame) {
    for (Control& control : look.controls) {
        if (!control.keys.empty()) set_factor(control, numbers_at(control, frame));
    }
    return look;
}

}  // namespace look
}  // namespace velatura::compositor
