// SPDX-License-Identifier: Apache-2.0
#include "usd/materialx/node_names.h"

#include <algorithm>
#include <array>

namespace velatura::usd::materialx {

namespace {

template <size_t N>
bool is_in(std::string_view name, const std::array<std::string_view, N>& names) {
    return std::find(names.begin(), names.end(), name) != names.end();
}

/// Named after the type of their input.
constexpr std::array<std::string_view, 10> by_input = {
    "extract",   "dotproduct", "magnitude", "distance",  "determinant",
    "separate2", "separate3",  "separate4", "luminance", "premult"};
/// Named after the types of input and output.
constexpr std::array<std::string_view, 2> by_both = {"convert", "swizzle"};
/// With a form for numbers beside a vector or color: "FA", by these inputs.
constexpr std::array<std::string_view, 12> with_number_form = {
    "add", "subtract", "multiply", "divide", "modulo",     "power",
    "min", "max",      "clamp",    "remap",  "smoothstep", "invert"};
constexpr std::array<std::string_view, 5> number_inputs = {"in2", "low", "inlow", "amount",
                                                           "amplitude"};
constexpr std::array<std::string_view, 3> noises = {"noise2d", "noise3d", "fractal3d"};
constexpr std::array<std::string_view, 3> comparisons = {"ifgreater", "ifgreatereq", "ifequal"};

std::string_view input_type(const NodeSignature& node, std::string_view name) {
    const auto it = node.inputs.find(name);
    return it == node.inputs.end() ? std::string_view() : it->second;
}

bool has_number_form(const NodeSignature& node) {
    if (node.type == "float") return false;
    if (!is_in(node.category, with_number_form) && !is_in(node.category, noises)) return false;
    return std::any_of(number_inputs.begin(), number_inputs.end(),
                       [&](std::string_view name) { return input_type(node, name) == "float"; });
}

/// "combine2" takes a color and a number, or two pairs, beside numbers.
std::string_view combine_form(const NodeSignature& node) {
    const std::string_view first = input_type(node, "in1"), second = input_type(node, "in2");
    if (first == "color3") return "CF";
    if (first == "vector3") return "VF";
    return first == "vector2" && second == "vector2" ? "VV" : "";
}

std::string normalmap_name(const NodeSignature& node) {
    if (node.is_before_139) return "ND_normalmap";
    return input_type(node, "scale") == "vector2" ? "ND_normalmap_vector2" : "ND_normalmap_float";
}

}  // namespace

std::string node_definition(const NodeSignature& node) {
    const std::string category(node.category), type(node.type);
    std::string_view in = input_type(node, "in");
    if (in.empty()) in = input_type(node, "in1");
    if (category == "normalmap") return normalmap_name(node);
    if (category.starts_with("Usd") && node.type != "surfaceshader") return "ND_" + category;
    if (is_in(node.category, by_both)) return "ND_" + category + "_" + std::string(in) + "_" + type;
    if (is_in(node.category, by_input)) return "ND_" + category + "_" + std::string(in);
    if (category == "displacement")
        return "ND_displacement_" + std::string(input_type(node, "displacement"));
    if (category == "surfacematerial") return "ND_surfacematerial";
    std::string name = "ND_" + category + "_" + type;
    if (category == "combine2") name += combine_form(node);
    if (category == "mix" && input_type(node, "mix") == type && type != "float") name += "_" + type;
    if (has_number_form(node)) name += "FA";
    if (is_in(node.category, comparisons)) {
        if (input_type(node, "value1") == "integer") name += "I";
        if (input_type(node, "value1") == "boolean") name += "B";
    }
    return name;
}

std::vector<NodeOutput> node_outputs(const NodeSignature& node) {
    const std::string_view in = input_type(node, "in");
    const auto channels = [](std::string_view names) {
        std::vector<NodeOutput> outputs;
        for (const char c : names) outputs.push_back({std::string("out") + c, "float"});
        return outputs;
    };
    if (node.category == "separate2") return channels("xy");
    if (node.category == "separate3") return channels(in == "color3" ? "rgb" : "xyz");
    if (node.category == "separate4") return channels(in == "color4" ? "rgba" : "xyzw");
    if (node.category == "UsdUVTexture")
        return {{"r", "float"}, {"g", "float"},    {"b", "float"},
                {"a", "float"}, {"rgb", "color3"}, {"rgba", "color4"}};
    return {{"out", std::string(node.type)}};
}

const std::vector<InterfaceInput>& surface_inputs(std::string_view category) {
    static const std::vector<InterfaceInput> none;
    static const std::vector<InterfaceInput> standard = {
        {"base", "float"},
        {"base_color", "color3"},
        {"diffuse_roughness", "float"},
        {"metalness", "float"},
        {"specular", "float"},
        {"specular_color", "color3"},
        {"specular_roughness", "float"},
        {"specular_IOR", "float"},
        {"specular_anisotropy", "float"},
        {"specular_rotation", "float"},
        {"transmission", "float"},
        {"transmission_color", "color3"},
        {"transmission_depth", "float"},
        {"transmission_scatter", "color3"},
        {"transmission_scatter_anisotropy", "float"},
        {"transmission_dispersion", "float"},
        {"transmission_extra_roughness", "float"},
        {"subsurface", "float"},
        {"subsurface_color", "color3"},
        {"subsurface_radius", "color3"},
        {"subsurface_scale", "float"},
        {"subsurface_anisotropy", "float"},
        {"sheen", "float"},
        {"sheen_color", "color3"},
        {"sheen_roughness", "float"},
        {"coat", "float"},
        {"coat_color", "color3"},
        {"coat_roughness", "float"},
        {"coat_anisotropy", "float"},
        {"coat_rotation", "float"},
        {"coat_IOR", "float"},
        {"coat_normal", "vector3"},
        {"coat_affect_color", "float"},
        {"coat_affect_roughness", "float"},
        {"thin_film_thickness", "float"},
        {"thin_film_IOR", "float"},
        {"emission", "float"},
        {"emission_color", "color3"},
        {"opacity", "color3"},
        {"thin_walled", "boolean"},
        {"normal", "vector3"},
        {"tangent", "vector3"}};
    static const std::vector<InterfaceInput> open_pbr = {
        {"base_weight", "float"},
        {"base_color", "color3"},
        {"base_diffuse_roughness", "float"},
        {"base_metalness", "float"},
        {"specular_weight", "float"},
        {"specular_color", "color3"},
        {"specular_roughness", "float"},
        {"specular_ior", "float"},
        {"specular_roughness_anisotropy", "float"},
        {"transmission_weight", "float"},
        {"transmission_color", "color3"},
        {"transmission_depth", "float"},
        {"transmission_scatter", "color3"},
        {"transmission_scatter_anisotropy", "float"},
        {"transmission_dispersion_scale", "float"},
        {"transmission_dispersion_abbe_number", "float"},
        {"subsurface_weight", "float"},
        {"subsurface_color", "color3"},
        {"subsurface_radius", "float"},
        {"subsurface_radius_scale", "color3"},
        {"subsurface_scatter_anisotropy", "float"},
        {"fuzz_weight", "float"},
        {"fuzz_color", "color3"},
        {"fuzz_roughness", "float"},
        {"coat_weight", "float"},
        {"coat_color", "color3"},
        {"coat_roughness", "float"},
        {"coat_roughness_anisotropy", "float"},
        {"coat_ior", "float"},
        {"coat_darkening", "float"},
        {"thin_film_weight", "float"},
        {"thin_film_thickness", "float"},
        {"thin_film_ior", "float"},
        {"emission_luminance", "float"},
        {"emission_color", "color3"},
        {"geometry_opacity", "float"},
        {"geometry_thin_walled", "boolean"},
        {"geometry_normal", "vector3"},
        {"geometry_coat_normal", "vector3"},
        {"geometry_tangent", "vector3"},
        {"geometry_coat_tangent", "vector3"}};
    static const std::vector<InterfaceInput> preview = {{"diffuseColor", "color3"},
                                                        {"emissiveColor", "color3"},
                                                        {"useSpecularWorkflow", "integer"},
                                                        {"specularColor", "color3"},
                                                        {"metallic", "float"},
                                                        {"roughness", "float"},
                                                        {"clearcoat", "float"},
                                                        {"clearcoatRoughness", "float"},
                                                        {"opacity", "float"},
                                                        {"opacityThreshold", "float"},
                                                        {"ior", "float"},
                                                        {"normal", "vector3"},
                                                        {"displacement", "float"},
                                                        {"occlusion", "float"}};
    if (category == "standard_surface") return standard;
    if (category == "open_pbr_surface") return open_pbr;
    if (category == "UsdPreviewSurface") return preview;
    return none;
}

}  // namespace velatura::usd::materialx
