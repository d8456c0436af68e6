// SPDX-License-Identifier: Apache-2.0
#include "translate/color/color_space.h"
#include "translate/context/values.h"
#include "translate/materials/materials.h"
#include "translate/materials/shader_inputs.h"
#include "translate/volumes/volumes.h"
#include "usd/stage/material_binding.h"
#include "usd/stage/primvars.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

namespace velatura::translate::volumes {

namespace {

/// Inputs of volume shaders, by the names that those of OpenUSD's own examples have, and the
/// attributes `velatura:volume:` of the prim that win over them.
struct OpticsInput {
    std::string_view own;     ///< after velatura:volume:
    std::string_view shader;  ///< after inputs:; empty: none
};

constexpr OpticsInput density_scale{"densityScale", "densityScale"};
constexpr OpticsInput extinction_color{"extinctionColor", ""};
constexpr OpticsInput albedo{"albedo", "albedo"};
constexpr OpticsInput anisotropy{"anisotropy", "anisotropy"};
constexpr OpticsInput emission_scale{"emissionScale", "heatScale"};
constexpr OpticsInput emission_color{"emissionColor", "emissionColor"};
constexpr OpticsInput temperature_scale{"temperatureScale", "temperatureScale"};
constexpr OpticsInput blackbody{"blackbody", "blackbody"};
constexpr std::array own_attributes = {density_scale,     extinction_color, albedo,
                                       anisotropy,        emission_scale,   emission_color,
                                       temperature_scale, blackbody};

/// Inputs that are fields.
struct FieldInput {
    std::string_view name;
    FieldRole role;
};

constexpr std::array field_inputs = {
    FieldInput{"density", FieldRole::Density}, FieldInput{"heat", FieldRole::Emission},
    FieldInput{"temperature", FieldRole::Temperature}, FieldInput{"albedo", FieldRole::Color}};

/// Glow of fire where nobody says: of a candle, about.
const Vec3d flame_color(1.0, 0.3, 0.05);

/// Black bodies are known up to here.
constexpr int last_kelvin = 10000;

std::vector<Rgb> blackbody_table(Context& ctx) {
    std::vector<Rgb> colors;
    for (int kelvin = 0; kelvin <= last_kelvin; kelvin += 100) {
        const Vec3d rgb = color::blackbody_color(ctx, double(kelvin));
        colors.emplace_back(float(rgb.x), float(rgb.y), float(rgb.z));
    }
    return colors;
}

class OpticsReader {
  public:
    OpticsReader(Context& ctx, Prim volume, std::map<std::string, FieldRole>& roles)
        : ctx_(ctx), volume_(volume), roles_(roles) {
        shader_ = volume_shader();
        if (shader_) read_shader_fields();
        warn_unknown_attributes();
    }

    double number(const OpticsInput& input, double fallback, double min, double max) {
        const Vec3d value = numbers(input, Vec3d(fallback), min, max);
        return value.x;
    }

    Vec3d numbers(const OpticsInput& input, const Vec3d& fallback, double min, double max) {
        return read(input, fallback, min, max, color::Meaning::Number);
    }

    Vec3d color(const OpticsInput& input, const Vec3d& fallback, double min, double max) {
        return read(input, fallback, min, max, color::Meaning::Color);
    }

  private:
    Vec3d read(const OpticsInput& input,
               const Vec3d& fallback,
               double min,
               double max,
               color::Meaning meaning) {
        Attribute from = volume_.attribute(fmt::format("velatura:volume:{}", input.own));
        if (!from.has_authored_value()) from = shader_value(input.shader);
        std::vector<double> rows;
        int width = 0;
        if (!from.is_valid() || !read_rows(from.value(ctx_.time), rows, width) || rows.empty())
            return fallback;
        const Vec3d read =
            rows.size() >= 3
                ? color::read_color(ctx_, from, meaning).value_or(Vec3d(rows[0], rows[1], rows[2]))
                : Vec3d(rows[0]);
        Vec3d value;
        for (int c = 0; c < 3; ++c)
            value[c] = std::isfinite(read[c]) ? std::clamp(read[c], min, max) : fallback[c];
        if (value != read)
            ctx_.warn("volume-optics", from,
                      fmt::format("{} of a volume must be in {:g} to {:g}; it is clamped",
                                  input.own, min, max));
        return value;
    }

    Prim volume_shader() {
        const auto binding = usd::stage::resolve_material(
            volume_, ctx_.state<materials::TranslatedMaterials>().purposes);
        if (!binding.material) return Prim();
        for (const char* name : {"outputs:velatura:volume", "outputs:volume"}) {
            const Attribute output = binding.material.attribute(name);
            if (!output.has_authored_connections()) continue;
            const Prim shader = materials::shader_source(ctx_, output).shader;
            if (!shader)
                ctx_.warn("unconnected-volume", output,
                          "volume output is not connected to a shader; the volume's own attributes "
                          "are used");
            return shader;
        }
        ctx_.warn(
            "unsupported-material", binding.material,
            "material of a volume has no volume output; the volume's own attributes are used");
        return Prim();
    }

    bool is_input(std::string_view name) const {
        const auto is_known = [&](const OpticsInput& i) { return i.shader == name; };
        const auto is_field = [&](const FieldInput& i) { return i.name == name; };
        return std::any_of(own_attributes.begin(), own_attributes.end(), is_known) ||
               std::any_of(field_inputs.begin(), field_inputs.end(), is_field);
    }

    /// Notes which fields the shader reads, and names what it has beside.
    void read_shader_fields() {
        const std::string id = read_text(shader_.attribute("info:id"), "", ctx_.time);
        ctx_.warn("unsupported-shader", shader_,
                  fmt::format("volume shader {} is not supported; only inputs with the names in "
                              "docs/reference/volumes.md are used",
                              id.empty() ? "without info:id" : id));
        for (const auto& property : shader_.property_names()) {
            const std::string& text = property.str();
            if (text.rfind("inputs:", 0) != 0) continue;
            const std::string name = text.substr(7);
            if (!is_input(name))
                ctx_.warn("unknown-shader-input", shader_.attribute(text),
                          fmt::format("input {} of a volume shader is ignored", name));
        }
        for (const FieldInput& input : field_inputs) {
            const materials::ShaderSource source = materials::shader_source(
                ctx_, shader_.attribute(fmt::format("inputs:{}", input.name)));
            const std::string reader =
                source.shader ? read_text(source.shader.attribute("info:id"), "", ctx_.time) : "";
            if (reader.rfind("HwFieldReader_", 0) != 0) continue;
            const std::string field =
                read_text(value_of(source.shader, "fieldname"), "", ctx_.time);
            if (!field.empty()) roles_[field] = input.role;
        }
    }

    /// The attribute that gives an input of a reader its value.
    Attribute value_of(Prim reader, std::string_view name) {
        return materials::shader_source(ctx_, reader.attribute(fmt::format("inputs:{}", name)))
            .value;
    }

    /// What the input holds, or the primvar of the volume that it reads; invalid: it says nothing.
    Attribute shader_value(std::string_view name) {
        if (!shader_ || name.empty()) return Attribute();
        const Attribute attribute = shader_.attribute(fmt::format("inputs:{}", name));
        const materials::ShaderSource source = materials::shader_source(ctx_, attribute);
        if (!source.shader) return source.value.has_authored_value() ? source.value : Attribute();
        const std::string id = read_text(source.shader.attribute("info:id"), "", ctx_.time);
        if (id.rfind("HwFieldReader_", 0) == 0) return Attribute();
        if (id.rfind("UsdPrimvarReader_", 0) != 0) {
            ctx_.warn("unsupported-connection", attribute,
                      fmt::format("{} of a volume comes from a node of type {}, which is not "
                                  "supported; it is ignored",
                                  name, id.empty() ? "unknown" : id));
            return Attribute();
        }
        const auto primvar =
            usd::stage::find_primvar(volume_, materials::primvar_name(ctx_, source.shader));
        return primvar ? primvar->attribute : value_of(source.shader, "fallback");
    }

    void warn_unknown_attributes() {
        constexpr std::string_view prefix = "velatura:volume:";
        for (const auto& property : volume_.property_names()) {
            const std::string& text = property.str();
            if (text.rfind(prefix, 0) != 0) continue;
            const std::string name = text.substr(prefix.size());
            const auto is_it = [&](const OpticsInput& i) { return i.own == name; };
            if (std::none_of(own_attributes.begin(), own_attributes.end(), is_it))
                ctx_.warn("unknown-attribute", volume_.attribute(text),
                          fmt::format("{} is not an attribute of a volume; it is ignored", text));
        }
    }

    Context& ctx_;
    Prim volume_, shader_;
    std::map<std::string, FieldRole>& roles_;
};

Rgb rgb(const Vec3d& v) {
    return {float(v.x), float(v.y), float(v.z)};
}

/// displayColor, if it is one color, as far as it can be an albedo, else a middle gray.
Vec3d usual_albedo(Context& ctx, Prim prim) {
    std::vector<float> rows;
    int width = 0;
    const auto primvar = usd::stage::find_primvar(prim, scene::display_color_primvar);
    const bool is_one = primvar && color::read_color_rows(ctx, primvar->attribute, rows, width) &&
                        width == 3 && rows.size() == 3;
    Vec3d color(0.5);
    for (int c = 0; is_one && c < 3; ++c)
        if (std::isfinite(rows[size_t(c)]))
            color[c] = std::clamp(double(rows[size_t(c)]), 0.0, 1.0);
    return color;
}

}  // namespace

scene::VolumeOptics read_volume_optics(Context& ctx,
                                       Prim prim,
                                       std::map<std::string, FieldRole>& roles) {
    constexpr double max = 1e30;
    OpticsReader read(ctx, prim, roles);
    scene::VolumeOptics optics;
    optics.density_scale = float(read.number(density_scale, 1.0, 0.0, max));
    optics.extinction_color = rgb(read.numbers(extinction_color, Vec3d(1.0), 0.0, max));
    optics.albedo = rgb(read.color(albedo, usual_albedo(ctx, prim), 0.0, 1.0));
    optics.anisotropy = float(read.number(anisotropy, 0.0, -1.0, 1.0));
    const double strength = read.number(emission_scale, 1.0, 0.0, max);
    optics.emission =
        rgb(read.color(emission_color, color::from_rec709(ctx, flame_color), 0.0, max) * strength);
    optics.temperature_scale = float(read.number(temperature_scale, 1.0, 0.0, max));
    optics.blackbody = float(read.number(blackbody, 1.0, 0.0, max));
    optics.blackbody_colors = blackbody_table(ctx);
    return optics;
}

}  // namespace velatura::translate::volumes
