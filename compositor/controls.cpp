// SPDX-License-Identifier: Apache-2.0
#include "compositor/controls.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <charconv>
#include <cmath>

namespace velatura::compositor {

namespace {

constexpr std::array<const char*, 6> kind_names = {"gain", "tint", "kelvin",
                                                   "mute", "solo", "shadow"};

bool parse_number(std::string_view text, float& value) {
    // from_chars takes no leading plus
    if (!text.empty() && text.front() == '+') text.remove_prefix(1);
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc() && end == text.data() + text.size() && std::isfinite(value);
}

Error bad(const std::string& text, const std::string& expected) {
    return {"bad-gain", fmt::format("'{}' is not understood; expected {}", text, expected)};
}

Result<std::array<float, 3>> parse_tint(const std::string& text) {
    std::array<float, 3> tint{};
    std::string_view rest = text;
    for (size_t c = 0; c < 3; ++c) {
        const size_t comma = rest.find(',');
        const bool is_last = c == 2;
        const bool is_good = (comma == std::string_view::npos) == is_last &&
                             parse_number(rest.substr(0, comma), tint[c]) && tint[c] >= 0.0f;
        if (!is_good) return bad(text, "a tint R,G,B of numbers from 0, for example 1,.9,.8");
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
    return {std::max(0.0, 3.2404542 * X - 1.5371385 - 0.4985314 * Z),
            std::max(0.0, -0.9692660 * X + 1.8760108 + 0.0415560 * Z),
            std::max(0.0, 0.0556434 * X - 0.2040259 + 1.0572252 * Z)};
}

}  // namespace

std::array<float, 3> kelvin_tint(float kelvin) {
    const auto white = planckian_rec709(6504.0);
    auto rgb = planckian_rec709(double(kelvin));
    for (size_t c = 0; c < 3; ++c) rgb[c] /= white[c];
    const double luminance = 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
    return {float(rgb[0] / luminance), float(rgb[1] / luminance), float(rgb[2] / luminance)};
}

Result<float> parse_gain(const std::string& text) {
    constexpr const char* expected = "a factor from 0 (2, 0.5) or stops (+1.5st, -1st)";
    float value = 0;
    if (text.ends_with("st")) {
        if (!parse_number(std::string_view(text).substr(0, text.size() - 2), value))
            return bad(text, expected);
        return std::exp2(value);
    }
    if (!parse_number(text, value) || value < 0.0f) return bad(text, expected);
    return value;
}

Result<Control> parse_control(Control::Kind kind, const std::string& text) {
    Control control;
    control.kind = kind;
    const bool has_value = kind != Control::Kind::Mute && kind != Control::Kind::Solo;
    const size_t equals = text.find('=');
    if (text.empty() || equals == 0 || (equals != std::string::npos) != has_value) {
        return bad(text, has_value ? "NAME=VALUE" : "NAME");
    }
    control.target = text.substr(0, equals);
    if (!has_value) return control;
    control.value = text.substr(equals + 1);
    if (kind == Control::Kind::Gain) {
        const auto gain = parse_gain(control.value);
        if (!gain) return gain.error();
        control.factor.fill(*gain);
    } else if (kind == Control::Kind::Tint) {
        const auto tint = parse_tint(control.value);
        if (!tint) return tint.error();
        control.factor = *tint;
    } else if (kind == Control::Kind::Kelvin) {
        float kelvin = 0;
        if (!parse_number(control.value, kelvin) || kelvin < 1667.0f || kelvin > 25000.0f) {
            return bad(control.value, "a colour temperature from 1667 to 25000");
        }
        control.factor = kelvin_tint(kelvin);
    } else {
        float lift = 0;
        if (!parse_number(control.value, lift) || lift < 0.0f || lift > 1.0f) {
            return bad(control.value, "a shadow lift from 0 (as rendered) to 1 (no shadow)");
        }
        control.factor.fill(lift);
    }
    return control;
}

std::string look_to_json(const Look& look) {
    nlohmann::ordered_json j;
    j["schema"] = "velatura.look/1";
    j["controls"] = nlohmann::ordered_json::array();
    for (const Control& c : look.controls) {
        nlohmann::ordered_json control;
        control["do"] = kind_names[size_t(c.kind)];
        control["name"] = c.target;
        if (!c.value.empty()) control["value"] = c.value;
        j["controls"].push_back(std::move(control));
    }
    j["exposure"] = look.exposure_stops;
    if (!look.display.empty()) j["display"] = look.display;
    if (!look.view.empty()) j["view"] = look.view;
    return j.dump(2) + "\n";
}

Result<Look> look_from_json(const std::string& text) {
    try {
        const auto j = nlohmann::json::parse(text);
        if (j.at("schema") != "velatura.look/1")
            return Error{"bad-preset", "the schema is not velatura.look/1"};
        Look look;
        for (const auto& c : j.at("controls")) {
            const auto kind_name = c.at("do").get<std::string>();
            const auto at = std::find(kind_names.begin(), kind_names.end(), kind_name);
            if (at == kind_names.end())
                return Error{"bad-preset", fmt::format("unknown control '{}'", kind_name)};
            std::string typed = c.at("name").get<std::string>();
            if (c.contains("value")) typed += "=" + c["value"].get<std::string>();
            auto control = parse_control(Control::Kind(at - kind_names.begin()), typed);
            if (!control) return Error{"bad-preset", control.error().message};
            look.controls.push_back(std::move(*control));
        }
        look.exposure_stops = j.value("exposure", 0.0f);
        look.display = j.value("display", "");
        look.view = j.value("view", "");
        return look;
    } catch (const nlohmann::json::exception& e) {
        return Error{"bad-preset", e.what()};
    }
}

}  // namespace velatura::compositor
