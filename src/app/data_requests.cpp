// SPDX-License-Identifier: Apache-2.0
#include "app/data_requests.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <iterator>

namespace velatura::app {

namespace {

using accumulate::DataFilter;
using accumulate::DataSource;

constexpr std::string_view primvar_prefix = "primvar:";

struct FilterWord {
    std::string_view word;
    DataFilter filter;
};

/// Names of filters in Karma, RenderMan and Arnold. Those that are means become the pixel filter of
/// the image.
constexpr FilterWord filter_words[] = {
    {"closest_filter", DataFilter::Closest},
    {"zmin", DataFilter::Closest},
    {"omin", DataFilter::Closest},
    {"filter", DataFilter::Average},
    {"same", DataFilter::Average},
    {"default", DataFilter::Average},
    {"box", DataFilter::Average},
    {"ubox", DataFilter::Average},
    {"gauss", DataFilter::Average},
    {"gaussian", DataFilter::Average},
    {"bartlett", DataFilter::Average},
    {"hanning", DataFilter::Average},
    {"catrom", DataFilter::Average},
    {"blackman", DataFilter::Average},
    {"mitchell", DataFilter::Average},
    {"sinc", DataFilter::Average},
    {"triangle", DataFilter::Average},
    {"box_filter", DataFilter::Average},
    {"gaussian_filter", DataFilter::Average},
    {"triangle_filter", DataFilter::Average},
    {"catrom_filter", DataFilter::Average},
    {"mitnet_filter", DataFilter::Average},
    {"sinc_filter", DataFilter::Average},
    {"blackman_harris_filter", DataFilter::Average},
};

/// Karma writes ["name", {"mode": "min"}].
std::string filter_word(const std::string& text) {
    const auto j = nlohmann::json::parse(text, nullptr, false);
    if (!j.is_array() || j.empty() || !j[0].is_string()) return text;
    const auto name = j[0].get<std::string>();
    if (name != "minmax") return name;
    const bool has_mode =
        j.size() > 1 && j[1].is_object() && j[1].contains("mode") && j[1]["mode"].is_string();
    return has_mode ? j[1]["mode"].get<std::string>() : name;
}

std::string legal(std::string name) {
    std::replace(name.begin(), name.end(), ':', '_');
    return name;
}

}  // namespace

Result<DataRequest> parse_data_request(const std::string& text) {
    DataRequest request;
    request.text = text;
    std::string source = text;
    if (const size_t equals = text.find('='); equals != std::string::npos) {
        request.name = text.substr(0, equals);
        source = text.substr(equals + 1);
    }
    const size_t colon = source.rfind(':');
    const size_t first = source.starts_with(primvar_prefix) ? primvar_prefix.size() : 1;
    if (colon != std::string::npos && colon >= first) {
        request.filter = accumulate::find_data_filter(source.substr(colon + 1));
        if (request.filter) source.resize(colon);
    }
    std::string usual;
    if (source.starts_with(primvar_prefix)) {
        request.source = DataSource::Primvar;
        usual = request.primvar = source.substr(primvar_prefix.size());
    } else if (const auto known = accumulate::find_data_source(source)) {
        request.source = *known;
        usual = accumulate::name_of(*known);
    }
    const bool is_named = text.find('=') == std::string::npos || !request.name.empty();
    if (usual.empty() || !is_named)
        return Error{
            "usage",
            fmt::format("unknown layer \"{}\"; expected bounce, light, matrix, shadow, "
                        "caster, lobe, lobe-matrix, data, none, or a data layer "
                        "[NAME=]SOURCE[:FILTER] of {}; filters: average, closest, min, max",
                        text, data_sources_text())};
    if (request.name.empty()) {
        request.name = legal(usual);
        const bool has_filter = request.filter && *request.filter != DataFilter::Average;
        if (has_filter) request.name += "_" + std::string(accumulate::name_of(*request.filter));
    }
    return request;
}

Result<DataFilter> parse_render_var_filter(const std::string& text) {
    const std::string word = filter_word(text);
    if (const auto own = accumulate::find_data_filter(word)) return *own;
    const auto known = std::find_if(std::begin(filter_words), std::end(filter_words),
                                    [&](const FilterWord& f) { return f.word == word; });
    if (known != std::end(filter_words)) return known->filter;
    return Error{"render-var",
                 fmt::format("filter \"{}\" is not supported, expected average, closest, "
                             "min or max; average is used",
                             text)};
}

std::optional<NumberType> number_type(std::string_view usd_type) {
    std::string type(usd_type);
    if (type.ends_with("[]")) type.resize(type.size() - 2);
    NumberType out;
    const auto role = [&](std::string_view name, std::string_view suffixes) {
        if (!type.starts_with(name) || type.size() != name.size() + 2) return false;
        const int width = type[name.size()] - '0';
        if (width < 2 || width > 4 || size_t(width) > suffixes.size()) return false;
        out.suffixes = suffixes.substr(0, size_t(width));
        out.is_half = type.back() == 'h';
        return true;
    };
    if (role("color", "RGBA")) {
        out.is_color = true;
        return out;
    }
    if (role("texCoord", "UVW") || role("normal", "XYZ") || role("vector", "XYZ") ||
        role("point", "XYZ"))
        return out;
    if (type == "quatf" || type == "quath" || type == "quatd") {
        out.suffixes = "XYZW";
        out.is_half = type == "quath";
        return out;
    }
    int width = 1;
    if (!type.empty() && type.back() >= '2' && type.back() <= '4' && type != "int64" &&
        type != "uint64") {
        width = type.back() - '0';
        type.pop_back();
    }
    static constexpr std::string_view wholes[] = {"int",    "uint",  "int64",
                                                  "uint64", "uchar", "bool"};
    out.is_whole = std::find(std::begin(wholes), std::end(wholes), type) != std::end(wholes);
    out.is_half = type == "half";
    if (!out.is_whole && !out.is_half && type != "float" && type != "double") return std::nullopt;
    out.suffixes = width == 1 ? "-" : std::string("XYZW").substr(0, size_t(width));
    return out;
}

Result<accumulate::DataLayer> make_primvar_layer(const scene::Scene& scene,
                                                 const std::string& primvar,
                                                 const std::string& data_type) {
    const auto found =
        std::find_if(scene.found_primvars.begin(), scene.found_primvars.end(),
                     [&](const scene::FoundPrimvar& p) { return p.name == primvar; });
    if (found == scene.found_primvars.end() || found->width == 0)
        return Error{"render-var", fmt::format("no geometry has a primvar \"{}\" of numbers; {}",
                                               primvar, primvars_text(scene))};
    accumulate::DataLayer layer;
    layer.source = DataSource::Primvar;
    layer.primvar = primvar;
    std::optional<NumberType> type = number_type(data_type);
    const std::optional<NumberType> own = number_type(found->type);
    if (!type) type = own;
    layer.suffixes = type ? type->suffixes : std::string();
    // Pairs are texture coordinates nearly always
    if (layer.suffixes.empty() || (!number_type(data_type) && found->width == 2))
        layer.suffixes = found->width == 1   ? "-"
                         : found->width == 2 ? "UV"
                                             : std::string("XYZW").substr(0, size_t(found->width));
    layer.is_half = type && type->is_half;
    layer.is_premultiplied = type && type->is_color;
    // A number that names something has no mean
    if (own && own->is_whole) layer.filter = DataFilter::Closest;
    return layer;
}

std::string data_sources_text() {
    std::string text;
    for (size_t i = 1; i < accumulate::data_source_count; ++i)
        text += fmt::format("{}, ", accumulate::name_of(DataSource(i)));
    return text + "primvar:NAME";
}

std::string primvars_text(const scene::Scene& scene) {
    constexpr size_t most = 40;
    std::string text;
    size_t count = 0;
    for (const scene::FoundPrimvar& p : scene.found_primvars) {
        if (count++ == most) return text + ", …";
        text += fmt::format("{}{}", text.empty() ? "primvars of the scene: " : ", ", p.name);
    }
    return text.empty() ? "the scene has no primvars" : text;
}

}  // namespace velatura::app
