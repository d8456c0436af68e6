// SPDX-License-Identifier: Apache-2.0
#include "translate/lights/filter_inputs.h"

#include "translate/color/color_space.h"
#include "translate/context/values.h"
#include "translate/materials/shader_inputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace velatura::translate::lights {

namespace {

/// What stands before the names of parameters, the longer ones first.
constexpr std::array prefixes = {"inputs:ri:lightFilter:",
                                 "inputs:ri:light:",
                                 "inputs:ri:",
                                 "inputs:arnold:",
                                 "inputs:moonray:",
                                 "inputs:",
                                 "primvars:arnold:",
                                 "arnold:",
                                 "moonray:",
                                 "ri:lightFilter:",
                                 "ri:"};

/// Properties that are no parameters.
constexpr std::array other_names = {
    "xformOp",   "visibility",   "purpose",    "collection:", "info:",  "outputs:",
    "primvars:", "lightFilter:", "light:",     "proxyPrim",   "extent", "ui:",
    "name",      "class",        "node_xform", "houdini:"};

/// The name of a parameter without its prefix; empty for what is none.
std::string parameter_name(std::string_view name) {
    for (const std::string_view prefix : prefixes) {
        if (!name.starts_with(prefix)) continue;
        name.remove_prefix(prefix.size());
        break;
    }
    for (const std::string_view other : other_names)
        if (name == other || (other.ends_with(':') && name.starts_with(other)) ||
            (other == "xformOp" && name.starts_with(other)))
            return "";
    return std::string(name);
}

/// Inputs of shaders that read a texture.
constexpr std::array file_inputs = {"inputs:filename", "inputs:file", "inputs:texture"};

}  // namespace

FilterInputs::FilterInputs(Context& ctx, Prim filter, Prim owner) : ctx_(ctx), filter_(filter) {
    for (const usd::layer::Token& token : owner.property_names()) {
        const std::string name = parameter_name(token.view());
        const Attribute attribute = owner.attribute(token.view());
        if (name.empty() || !attribute) continue;
        if (attribute.has_authored_value() || attribute.has_authored_connections())
            attributes_.try_emplace(name, attribute);
    }
}

bool FilterInputs::has(Names names) const {
    return std::any_of(names.begin(), names.end(),
                       [&](const char* name) { return attributes_.contains(name); });
}

Attribute FilterInputs::find(Names names) {
    for (const char* name : names) asked_.insert(name);
    for (const char* name : names) {
        const auto at = attributes_.find(name);
        if (at == attributes_.end()) continue;
        if (!at->second.has_authored_connections()) return at->second;
        const materials::ShaderSource source = materials::shader_source(ctx_, at->second);
        if (!source.shader && source.value.is_valid()) return source.value;
        ctx_.warn(
            "unsupported-light-filter-input", at->second,
            fmt::format("{} of the light filter is fed by a shader, which is not evaluated; "
                        "{} is used",
                        name, at->second.has_authored_value() ? "its own value" : "its default"));
        return at->second;
    }
    return {};
}

double FilterInputs::number(Names names, double fallback) {
    const Attribute attribute = find(names);
    const double value = attribute ? read_number(attribute, fallback, ctx_.time) : fallback;
    if (std::isfinite(value)) return value;
    ctx_.warn(
        "bad-light-filter", attribute,
        fmt::format("{} of the light filter is not finite, {} is used", *names.begin(), fallback));
    return fallback;
}

bool FilterInputs::flag(Names names, bool fallback) {
    const Attribute attribute = find(names);
    return attribute ? read_bool(attribute, fallback, ctx_.time) : fallback;
}

Vec2 FilterInputs::pair(Names names, const Vec2& fallback) {
    const Attribute attribute = find(names);
    const auto value = attribute ? read_vector(attribute, 2, ctx_.time) : std::nullopt;
    return value ? Vec2(float((*value)[0]), float((*value)[1])) : fallback;
}

Rgb FilterInputs::color(Names names, const Rgb& fallback) {
    const Attribute attribute = find(names);
    if (!attribute) return fallback;
    const auto value = color::read_light_color(ctx_, attribute);
    if (!value) return fallback;
    const Rgb rgb = to_float(*value);
    if (rgb.x >= 0.0f && rgb.y >= 0.0f && rgb.z >= 0.0f && velatura::is_finite(rgb)) return rgb;
    ctx_.warn("bad-light-filter", attribute,
              fmt::format("{} of the light filter is negative or not finite; its default is used",
                          *names.begin()));
    return fallback;
}

std::vector<float> FilterInputs::numbers(Names names) {
    const Attribute attribute = find(names);
    std::vector<float> rows;
    int width = 0;
    if (attribute && read_rows(attribute.value(ctx_.time), rows, width) && width == 1) return rows;
    return {};
}

std::vector<Rgb> FilterInputs::colors(Names names) {
    const Attribute attribute = find(names);
    std::vector<float> rows;
    int width = 0;
    std::vector<Rgb> out;
    if (!attribute || !read_rows(attribute.value(ctx_.time), rows, width) || width != 3) return out;
    for (size_t i = 0; i + 2 < rows.size(); i += 3)
        out.emplace_back(rows[i], rows[i + 1], rows[i + 2]);
    return out;
}

std::optional<Mat4d> FilterInputs::matrix(Names names) {
    const Attribute attribute = find(names);
    if (!attribute) return std::nullopt;
    return attribute.get<Mat4d>(ctx_.time);
}

int FilterInputs::choice(Names names, std::initializer_list<const char*> choices, int fallback) {
    const Attribute attribute = find(names);
    if (!attribute) return fallback;
    const std::string text = read_text(attribute, "", ctx_.time);
    const auto count = int(choices.size());
    int number = -1;
    if (text.empty()) {
        number = read_int(attribute, -1, ctx_.time);
    } else {
        const auto at = std::find(choices.begin(), choices.end(), text);
        if (at != choices.end()) number = int(at - choices.begin());
    }
    if (number >= 0 && number < count) return number;
    ctx_.warn("unsupported-light-filter-input", attribute,
              fmt::format("{} of the light filter has an unknown value; {} is used", *names.begin(),
                          choices.begin()[fallback]));
    return fallback;
}

std::optional<FilterTexture> FilterInputs::texture(Names names) {
    for (const char* name : names) asked_.insert(name);
    for (const char* name : names) {
        const auto at = attributes_.find(name);
        if (at == attributes_.end()) continue;
        Attribute file = at->second;
        if (file.has_authored_connections()) {
            const materials::ShaderSource source = materials::shader_source(ctx_, file);
            file = source.value;
            if (source.shader) {
                file = {};
                for (const char* input : file_inputs)
                    if (!file) file = source.shader.attribute(input);
            }
        }
        const std::string authored = file ? read_text(file, "", ctx_.time) : std::string();
        if (authored.empty()) continue;
        FilterTexture out;
        out.file = file.resolved_asset_path(ctx_.time);
        // Names of files that are strings are not anchored to a layer
        if (out.file.empty()) out.file = authored;
        out.colors = color::texel_colors_of(ctx_, {file}, color::Meaning::Color)
                         .value_or(color::unmarked_texels(ctx_, scene::SourceColorSpace::Auto,
                                                          color::Meaning::Color));
        return out;
    }
    return std::nullopt;
}

void FilterInputs::expect(Names names, double neutral, const char* consequence) {
    const Attribute attribute = find(names);
    if (!attribute) return;
    if (read_number(attribute, neutral, ctx_.time) == neutral) return;
    ctx_.warn(
        "unsupported-light-filter-input", attribute,
        fmt::format("{} of the light filter is not supported; {}", *names.begin(), consequence));
}

void FilterInputs::ignore(Names names) {
    for (const char* name : names) asked_.insert(name);
}

void FilterInputs::warn_rest() {
    for (const auto& [name, attribute] : attributes_) {
        // An empty text says nothing
        if (asked_.contains(name) || read_text(attribute, "-", ctx_.time).empty()) continue;
        ctx_.warn("unsupported-light-filter-input", attribute,
                  fmt::format("{} of the light filter is not supported; the filter is rendered as "
                              "if it were not authored",
                              name));
    }
}

void FilterInputs::warn(const std::string& code, const std::string& message) {
    ctx_.warn(code, filter_, message);
}

}  // namespace velatura::translate::lights
