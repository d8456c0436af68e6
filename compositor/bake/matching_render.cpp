// SPDX-License-Identifier: Apache-2.0
#include "compositor/bake/matching_render.h"

#include "compositor/io/file_frame.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdlib>
#include <sstream>

namespace velatura::compositor::bake {

namespace {

/// The policy of --lights that the rows of a file come from.
std::string light_policy(const LayerStack& stack) {
    const auto groups = stack.group_names();
    const bool has_rest = std::find(groups.begin(), groups.end(), "rest") != groups.end();
    if (!has_rest) return "per-light";
    return groups.size() <= 2 ? "off" : "groups";
}

/// An object of the header; empty where it is none.
nlohmann::json json_of(const LayerStack& stack, const char* attribute) {
    auto j = nlohmann::json::parse(stack.image().text(attribute), nullptr, false);
    return j.is_object() ? j : nlohmann::json::object();
}

/// A member that is an object or a list, or an empty one.
nlohmann::json member(const nlohmann::json& j, const char* name) {
    if (!j.is_object() || !j.contains(name) || !j[name].is_structured())
        return nlohmann::json::object();
    return j[name];
}

/// Empty for what is no text.
std::string text_of(const nlohmann::json& j, const std::string& name) {
    return j.is_object() && j.contains(name) && j[name].is_string() ? j[name].get<std::string>()
                                                                    : std::string();
}

std::vector<std::string> words_of(const std::string& text) {
    std::vector<std::string> words;
    std::istringstream in(text);
    for (std::string word; in >> word;) words.push_back(word);
    return words;
}

/// In place of the option of that name, or after all others.
void set_option(std::vector<RenderOption>& options, RenderOption option) {
    const auto at = std::find_if(options.begin(), options.end(),
                                 [&](const RenderOption& o) { return o.name == option.name; });
    if (at == options.end()) {
        options.push_back(std::move(option));
    } else {
        *at = std::move(option);
    }
}

/// What `velatura/settings` tells by the names of options: the first word of each is its value.
void add_settings(const nlohmann::json& settings, std::vector<RenderOption>& options) {
    for (const char* name :
         {"--max-depth", "--filter", "--integrator", "--light-sampling", "--light-selection",
          "--roulette", "--sampler", "--adaptive", "--splitting", "--caustics", "--accel",
          "--guiding", "--texture-bias", "--volume-bounds", "--working-space"}) {
        const auto words = words_of(text_of(settings, name));
        if (!words.empty()) set_option(options, {name, {words[0]}});
        if (words.size() > 1 && words[0] == "cutoff") set_option(options, {"--cutoff", {words[1]}});
    }
    const std::string effects = text_of(settings, "--effects");
    if (!effects.empty() && effects != "none") set_option(options, {"--effects", {effects}});
    if (const std::string purposes = text_of(settings, "purposes"); !purposes.empty())
        set_option(options, {"--purpose", {purposes}});
    // Rate, level or −1, most triangles
    const auto dicing = words_of(text_of(settings, "dicing"));
    if (dicing.size() != 3) return;
    set_option(options, {"--dicing-rate", {dicing[0]}});
    if (dicing[1] != "-1") set_option(options, {"--subdivision-level", {dicing[1]}});
    const double triangles = std::strtod(dicing[2].c_str(), nullptr);
    set_option(options, {"--dicing-limit", {fmt::format("{}", triangles / 1e6)}});
}

/// Options of the estimator, as they were typed.
void add_estimator(const nlohmann::json& stats, std::vector<RenderOption>& options) {
    const nlohmann::json e = member(stats, "estimator");
    constexpr const char* names[][2] = {{"integrator", "--integrator"},
                                        {"light_sampling", "--light-sampling"},
                                        {"light_selection", "--light-selection"},
                                        {"roulette", "--roulette"},
                                        {"sampler", "--sampler"},
                                        {"accelerator", "--accel"},
                                        {"guiding", "--guiding"},
                                        {"splitting", "--splitting"},
                                        {"caustics", "--caustics"}};
    for (const auto& [name, option] : names) {
        if (const std::string value = text_of(e, name); !value.empty())
            set_option(options, {option, {value}});
    }
    if (e.contains("adaptive") && e["adaptive"].is_boolean())
        set_option(options, {"--adaptive", {e["adaptive"].get<bool>() ? "on" : "off"}});
}

/// Approximations in force, of files from before there were settings.
void add_ledger(const nlohmann::json& stats, std::vector<RenderOption>& options) {
    std::string effects;
    for (const auto& line : member(stats, "ledger")) {
        const std::string what = text_of(line, "approximation");
        if (what == "effect-left-out" && !text_of(line, "value").empty())
            effects += (effects.empty() ? "-" : ",-") + text_of(line, "value");
        if (what == "max-depth" && line.contains("value") && line["value"].is_number_integer())
            set_option(options, {"--max-depth", {fmt::format("{}", line["value"].get<int>())}});
    }
    if (!effects.empty()) set_option(options, {"--effects", {effects}});
}

bool is_option(const std::string& word) {
    return word.size() > 1 && word[0] == '-' && (word[1] < '0' || word[1] > '9') && word[1] != '.';
}

/// The name without its short form.
std::string long_name(const std::string& name) {
    return name == "-c" ? "--camera" : name == "-f" ? "--frames" : name;
}

}  // namespace

std::vector<RenderOption> matching_render_options(
    const LayerStack& stack, const std::optional<std::array<double, 4>>& crop) {
    const image::Image& image = stack.image();
    const layers::SampleInfo& samples = stack.header().samples;
    const int width = image.display.width(), height = image.display.height();
    std::vector<RenderOption> out = {{"--res", {std::to_string(width), std::to_string(height)}}};
    const auto add_crop = [&](const std::array<double, 4>& c) {
        RenderOption option{"--crop", {}};
        for (const double edge : c) option.values.push_back(fmt::format("{}", edge));
        out.push_back(std::move(option));
    };
    if (crop) {
        add_crop(*crop);
    } else if (image.data != image.display) {
        const image::Window& w = image.data;
        add_crop({double(w.x0) / width, double(w.x1) / width, 1 - double(w.y1) / height,
                  1 - double(w.y0) / height});
    }
    // Any other seed: the two images must not have their noise in common
    out.push_back({"--seed", {std::to_string((samples.seed ^ 0x5eed) & 0x7fffffff)}});
    out.push_back({"--spp", {std::to_string(samples.end - samples.first)}});
    out.push_back({"--lights", {light_policy(stack)}});
    const std::string camera = text_of(json_of(stack, layers::scene_attribute), "camera");
    if (camera.starts_with("/")) out.push_back({"--camera", {camera}});
    if (const auto frame = frame_of(image))
        out.push_back({"--frames", {fmt::format("{}", *frame)}});
    const nlohmann::json stats = json_of(stack, layers::stats_attribute);
    const nlohmann::json settings = member(json_of(stack, layers::settings_attribute), "settings");
    if (settings.empty()) add_ledger(stats, out);
    add_settings(settings, out);
    add_estimator(stats, out);
    return out;
}

void override_options(std::vector<RenderOption>& options, const std::vector<RenderOption>& by) {
    std::erase_if(options, [&](const RenderOption& option) {
        return std::any_of(by.begin(), by.end(),
                           [&](const RenderOption& o) { return o.name == option.name; });
    });
    options.insert(options.end(), by.begin(), by.end());
}

std::vector<RenderOption> options_of(const std::string& line) {
    std::vector<RenderOption> options;
    for (const std::string& word : words_of(line)) {
        if (is_option(word)) {
            const size_t equals = word.find('=');
            options.push_back({long_name(word.substr(0, equals)), {}});
            if (equals != std::string::npos)
                options.back().values.push_back(word.substr(equals + 1));
        } else if (!options.empty()) {
            options.back().values.push_back(word);
        }
    }
    return options;
}

std::vector<std::string> arguments_of(const std::vector<RenderOption>& options) {
    std::vector<std::string> out;
    for (const RenderOption& o : options) {
        // A value that looks like an option
        if (o.values.size() == 1 && is_option(o.values[0])) {
            out.push_back(o.name + "=" + o.values[0]);
            continue;
        }
        out.push_back(o.name);
        out.insert(out.end(), o.values.begin(), o.values.end());
    }
    return out;
}

}  // namespace velatura::compositor::bake
