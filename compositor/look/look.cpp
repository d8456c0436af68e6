// SPDX-License-Identifier: Apache-2.0
#include "base/json_depth.h"
#include "compositor/look/controls.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>

namespace velatura::compositor {
inline namespace look {

namespace {

constexpr const char* schema = "velatura.look/1";
constexpr int kinds = int(Control::Kind::Clamp) + 1;

Error bad_preset(const std::string& why) {
    return {"bad-preset", why};
}

/// `keys`: {"1": "0.5", "24": 2} in place of a value.
std::string keys_as_value(const nlohmann::json& keys) {
    std::string text;
    for (const auto& [frame, value] : keys.items()) {
        const std::string typed = value.is_string() ? value.get<std::string>() : value.dump();
        text += (text.empty() ? "" : ",") + typed + "@" + frame;
    }
    return text;
}

Result<Control> control_from_json(const nlohmann::json& c) {
    const auto name = c.at("do").get<std::string>();
    int kind = 0;
    while (kind < kinds && name != name_of(Control::Kind(kind))) ++kind;
    if (kind == kinds) return bad_preset(fmt::format("unknown control '{}'", name));
    const std::string value = c.contains("keys") ? keys_as_value(c["keys"]) : c.value("value", "");
    auto control = make_control(Control::Kind(kind), c.at("name").get<std::string>(), value);
    if (!control) return bad_preset(control.error().message);
    control->matte = c.value("matte", "");
    return control;
}

/// What a control acts on, as it is typed.
std::string target_of(const Control& c) {
    const std::string where = c.matte.empty() ? "" : " --matte " + c.matte;
    return fmt::format("--{} {}{}", name_of(c.kind), c.target, where);
}

std::vector<std::string> values_of(const Look& look, const std::string& target) {
    std::vector<std::string> values;
    for (const Control& c : look.controls) {
        if (target_of(c) == target) values.push_back(c.value.empty() ? "on" : c.value);
    }
    return values;
}

void compare(std::vector<std::string>& lines,
             const std::string& what,
             const std::string& a,
             const std::string& b) {
    if (a == b) return;
    if (a.empty()) {
        lines.push_back(fmt::format("+ {} {}", what, b));
    } else if (b.empty()) {
        lines.push_back(fmt::format("- {} {}", what, a));
    } else {
        lines.push_back(fmt::format("  {} {} -> {}", what, a, b));
    }
}

}  // namespace

std::string look_to_json(const Look& look) {
    nlohmann::ordered_json j;
    j["schema"] = schema;
    if (!look.rows.empty()) j["rows"] = look.rows;
    j["controls"] = nlohmann::ordered_json::array();
    for (const Control& c : look.controls) {
        nlohmann::ordered_json control;
        control["do"] = name_of(c.kind);
        control["name"] = c.target;
        if (!c.value.empty()) control["value"] = c.value;
        if (!c.matte.empty()) control["matte"] = c.matte;
        j["controls"].push_back(std::move(control));
    }
    j["exposure"] = look.exposure_stops;
    if (!look.display.empty()) j["display"] = look.display;
    if (!look.view.empty()) j["view"] = look.view;
    return j.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

Result<Look> look_from_json(const std::string& text) {
    if (is_json_too_deep(text)) return bad_preset("it is nested too deeply");
    try {
        const auto j = nlohmann::json::parse(text);
        if (j.at("schema") != schema)
            return bad_preset(fmt::format("the schema is not {}", schema));
        Look look;
        const auto rows = j.value("rows", nlohmann::json::object());
        for (const auto& [name, list] : rows.items()) {
            const auto added = add_rows(look, name, list.get<std::vector<std::string>>());
            if (!added) return bad_preset(added.error().message);
        }
        for (const auto& c : j.at("controls")) {
            auto control = control_from_json(c);
            if (!control) return control.error();
            look.controls.push_back(std::move(*control));
        }
        const double exposure = j.value("exposure", 0.0);
        if (!(std::abs(exposure) <= double(largest_stops)))
            return bad_preset(
                fmt::format("an exposure of {} stops; the maximum is {}", exposure, largest_stops));
        look.exposure_stops = float(exposure);
        look.display = j.value("display", "");
        look.view = j.value("view", "");
        return look;
    } catch (const nlohmann::json::exception& e) {
        return bad_preset(e.what());
    }
}

std::vector<std::string> look_differences(const Look& a, const Look& b) {
    std::vector<std::string> lines, targets;
    for (const Look* look : {&a, &b}) {
        for (const Control& c : look->controls) {
            const std::string target = target_of(c);
            if (std::find(targets.begin(), targets.end(), target) == targets.end())
                targets.push_back(target);
        }
    }
    for (const std::string& target : targets) {
        const auto in_a = values_of(a, target), in_b = values_of(b, target);
        compare(lines, target, fmt::format("{}", fmt::join(in_a, " ")),
                fmt::format("{}", fmt::join(in_b, " ")));
    }
    std::map<std::string, std::array<std::string, 2>> rows;
    for (const auto& [name, list] : a.rows) rows[name][0] = fmt::format("{}", fmt::join(list, ","));
    for (const auto& [name, list] : b.rows) rows[name][1] = fmt::format("{}", fmt::join(list, ","));
    for (const auto& [name, lists] : rows) compare(lines, "--rows " + name, lists[0], lists[1]);
    const auto stops = [](const Look& look) {
        return look.exposure_stops == 0.0f ? "" : fmt::format("{}", look.exposure_stops);
    };
    compare(lines, "--exposure", stops(a), stops(b));
    compare(lines, "--display", a.display, b.display);
    compare(lines, "--view", a.view, b.view);
    return lines;
}

}  // namespace look
}  // namespace velatura::compositor
