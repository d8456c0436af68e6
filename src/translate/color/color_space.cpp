// SPDX-License-Identifier: Apache-2.0
#include "translate/color/color_space.h"

#include "translate/color/blackbody.h"
#include "translate/color/named_color_space.h"
#include "translate/context/values.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace velatura::translate::color {

namespace {

std::string text_of(const std::optional<usd::layer::Value>& value) {
    if (!value) return {};
    if (const auto* token = value->get_if<usd::layer::Token>()) return token->str();
    if (const auto* text = value->get_if<std::string>()) return *text;
    return {};
}

/// The curve of a definition, as OpenUSD's nanocolor has it: a power above a straight piece.
void set_curve(double gamma, double bias, scene::ColorDecoding& out) {
    out.exponent = gamma;
    if (gamma == 1.0 || !(bias > 0.0)) return;
    out.offset = bias;
    out.cut = bias / (gamma - 1.0);
    out.slope =
        bias / std::pow(gamma * bias / (gamma + gamma * bias - 1.0 - bias), gamma) / (gamma - 1.0);
}

/// A space that the prim defines under this name. Ref: UsdColorSpaceDefinitionAPI.
std::optional<ColorSpace> defined_on(Prim prim,
                                     std::string_view name,
                                     const ColorWarning& warn_color) {
    constexpr std::string_view schema = "ColorSpaceDefinitionAPI:";
    for (const auto& applied : prim.applied_schemas()) {
        if (!applied.view().starts_with(schema)) continue;
        const std::string start =
            "colorSpaceDefinition:" + std::string(applied.view().substr(schema.size())) + ":";
        const auto attribute = [&](const char* part) { return prim.attribute(start + part); };
        if (read_text(attribute("name"), "custom", TimeCode()) != name) continue;
        const auto pair = [&](const char* part, std::array<double, 2> otherwise) {
            const auto v = read_vector(attribute(part), 2, TimeCode());
            return v ? std::array<double, 2>{(*v)[0], (*v)[1]} : otherwise;
        };
        const Primaries p = {pair("redChroma", {1, 0}), pair("greenChroma", {0, 1}),
                             pair("blueChroma", {0, 0}), pair("whitePoint", {1.0 / 3, 1.0 / 3})};
        std::optional<ColorSpace> space = linear_space_of(p);
        const double gamma = read_number(attribute("gamma"), 1.0, TimeCode());
        const double bias = read_number(attribute("linearBias"), 0.0, TimeCode());
        if (!space || !(gamma > 0.0) || !std::isfinite(gamma) || !std::isfinite(bias)) {
            warn_color("bad-color-space", attribute("name"),
                       fmt::format("color space {} has no three primaries, no white or no positive "
                                   "gamma; its values are read as linear Rec.709",
                                   name));
            return ColorSpace();
        }
        set_curve(gamma, bias, space->decoding);
        return space;
    }
    return std::nullopt;
}

/// A space by its name, also one that the prim or one above defines.
std::optional<ColorSpace> find_space(Prim prim,
                                     std::string_view name,
                                     const ColorWarning& warn_color) {
    if (const ColorSpace* known = named_color_space(name)) return *known;
    for (Prim at = prim; at && !at.is_pseudo_root(); at = at.parent()) {
        if (!at.has_api("ColorSpaceDefinitionAPI")) continue;
        if (const auto defined = defined_on(at, name, warn_color)) return defined;
    }
    return std::nullopt;
}

/// What the prim says of all that it and the prims below hold.
std::optional<ColorSpace> said_by(Prim prim, const ColorWarning& warn_color) {
    const Attribute attribute = prim.attribute("colorSpace:name");
    if (!attribute.is_authored()) return std::nullopt;
    const std::string name = read_text(attribute, "", TimeCode());
    if (!prim.has_api("ColorSpaceAPI")) {
        warn_color("unapplied-schema", attribute,
                   "colorSpace:name needs ColorSpaceAPI in apiSchemas; it is ignored");
        return std::nullopt;
    }
    if (name.empty()) return std::nullopt;
    if (auto space = find_space(prim, name, warn_color)) return space;
    warn_color(
        "unknown-color-space", attribute,
        fmt::format(
            "color space {} is unknown; colors of <{}> and its children are read as linear Rec.709",
            name, prim.path_string()));
    return ColorSpace();
}

/// The same of the nearest that says something.
std::optional<ColorSpace> said_above(Prim prim, const ColorWarning& warn_color) {
    for (Prim at = prim; at && !at.is_pseudo_root(); at = at.parent())
        if (const auto space = said_by(at, warn_color)) return space;
    return std::nullopt;
}

std::optional<ColorSpace> own_space(const Attribute& attribute, const ColorWarning& warn_color) {
    const std::string name = text_of(attribute.metadata("colorSpace"));
    if (name.empty()) return std::nullopt;
    if (auto space = find_space(attribute.prim(), name, warn_color)) return space;
    warn_color("unknown-color-space", attribute,
               fmt::format("color space {} of {} is unknown; its values are read as linear Rec.709",
                           name, attribute.name().str()));
    return ColorSpace();
}

ColorWarning complaint_of(Context& ctx) {
    return [&ctx](std::string code, const Attribute& where, std::string message) {
        ctx.warn(std::move(code), where, std::move(message));
    };
}

/// As said_above, asked once of each prim.
/// State of this module: what ColorSpaceAPI says on a prim or above it.
struct PrimSpaces {
    std::unordered_map<const usd::stage::PrimData*, std::optional<ColorSpace>> of_prim;
};

const std::optional<ColorSpace>& inherited_space(Context& ctx, Prim prim) {
    static const std::optional<ColorSpace> none;
    if (!prim || prim.is_pseudo_root()) return none;
    auto& spaces = ctx.state<PrimSpaces>().of_prim;
    if (const auto known = spaces.find(prim.data()); known != spaces.end()) return known->second;
    std::optional<ColorSpace> space = said_by(prim, complaint_of(ctx));
    if (!space) space = inherited_space(ctx, prim.parent());
    return spaces.emplace(prim.data(), space).first->second;
}

std::optional<ColorSpace> space_in(Context& ctx, const Attribute& attribute) {
    if (auto own = own_space(attribute, complaint_of(ctx))) return own;
    if (!is_color(attribute)) return std::nullopt;
    return inherited_space(ctx, attribute.prim());
}

scene::ColorDecoding decoding_of(Context& ctx, const ColorSpace& space, Meaning meaning) {
    return meaning == Meaning::Number ? space.decoding : ctx.state<WorkingSpace>().from(space);
}

/// What makes the numbers of an attribute those of the renderer.
scene::ColorDecoding decoding_of(Context& ctx, const Attribute& attribute, Meaning meaning) {
    const std::optional<ColorSpace> space = space_in(ctx, attribute);
    if (meaning == Meaning::ByType && !space && !is_color(attribute)) return {};
    return decoding_of(ctx, space.value_or(ColorSpace()), meaning);
}

scene::TexelColors texel_colors_in(Context& ctx, const ColorSpace& space, Meaning meaning) {
    scene::TexelColors colors{scene::SourceColorSpace::Raw, decoding_of(ctx, space, meaning)};
    if (!space.is_srgb) return colors;
    // sRGB comes off before texels are filtered
    colors.curve = scene::SourceColorSpace::Srgb;
    const auto to_working = colors.decoding.to_working;
    colors.decoding = scene::ColorDecoding();
    colors.decoding.to_working = to_working;
    return colors;
}

}  // namespace

bool is_color(const Attribute& attribute) {
    return attribute.type_name().view().starts_with("color");
}

std::optional<ColorSpace> color_space_of(const Attribute& attribute,
                                         const ColorWarning& warn_color) {
    if (auto own = own_space(attribute, warn_color)) return own;
    return is_color(attribute) ? said_above(attribute.prim(), warn_color) : std::nullopt;
}

bool read_color_rows(Context& ctx,
                     const Attribute& attribute,
                     std::vector<float>& out,
                     int& width,
                     Meaning meaning) {
    if (!read_rows(attribute.value(ctx.time), out, width)) return false;
    if (width != 3 && width != 4) return true;
    const scene::ColorDecoding decoding = decoding_of(ctx, attribute, meaning);
    if (decoding.is_identity()) return true;
    for (size_t i = 0; i + 2 < out.size(); i += size_t(width)) {
        const Vec3d color = decoding(Vec3d(double(out[i]), double(out[i + 1]), double(out[i + 2])));
        for (size_t c = 0; c < 3; ++c) out[i + c] = float(color[int(c)]);
    }
    return true;
}

std::optional<Vec3d> read_color(Context& ctx, const Attribute& attribute, Meaning meaning) {
    const auto v = read_vector(attribute, 3, ctx.time);
    if (!v) return std::nullopt;
    const Vec3d color((*v)[0], (*v)[1], (*v)[2]);
    return decoding_of(ctx, attribute, meaning)(color);
}

std::optional<Vec3d> read_light_color(Context& ctx, const Attribute& attribute) {
    std::optional<Vec3d> color = read_color(ctx, attribute);
    const auto authored = read_vector(attribute, 3, ctx.time);
    const auto min_of = [](const auto& v) { return std::min({v[0], v[1], v[2]}); };
    if (!color || !(min_of(*color) < 0.0) || min_of(*authored) < 0.0) return color;
    ctx.warn("color-outside-gamut", attribute,
             fmt::format("{} is ({:.4g}, {:.4g}, {:.4g}) in {}, which is not a valid light color; "
                         "negative channels are set to 0",
                         attribute.name().str(), color->x, color->y, color->z,
                         ctx.state<WorkingSpace>().label()));
    for (int c = 0; c < 3; ++c) (*color)[c] = std::max((*color)[c], 0.0);
    return color;
}

std::optional<scene::TexelColors> texel_colors_of(Context& ctx,
                                                  Prim prim,
                                                  std::string_view name,
                                                  Meaning meaning) {
    const std::string bare = bare_color_space_name(name);
    if (bare == "auto" || bare == "unknown")
        return unmarked_texels(ctx, scene::SourceColorSpace::Auto, meaning);
    const auto space = find_space(prim, name, complaint_of(ctx));
    return space ? std::optional(texel_colors_in(ctx, *space, meaning)) : std::nullopt;
}

std::optional<scene::TexelColors> texel_colors_of(Context& ctx,
                                                  const std::vector<Attribute>& files,
                                                  Meaning meaning) {
    for (const Attribute& file : files) {
        const std::string name = text_of(file.metadata("colorSpace"));
        if (name.empty()) continue;
        if (const auto named = texel_colors_of(ctx, file.prim(), name, meaning)) return named;
        ctx.warn(
            "unknown-color-space", file,
            fmt::format("color space {} is unknown, the image is read as without a color space",
                        name));
        return std::nullopt;
    }
    if (files.empty()) return std::nullopt;
    const std::optional<ColorSpace>& above = inherited_space(ctx, files.front().prim());
    return above ? std::optional(texel_colors_in(ctx, *above, meaning)) : std::nullopt;
}

scene::TexelColors unmarked_texels(Context& ctx, scene::SourceColorSpace curve, Meaning meaning) {
    return {curve, decoding_of(ctx, ColorSpace(), meaning)};
}

Vec3d from_rec709(Context& ctx, const Vec3d& color) {
    return ctx.state<WorkingSpace>().from_rec709(color);
}

Vec3d blackbody_color(Context& ctx, double kelvin) {
    return from_rec709(ctx, blackbody_rgb(kelvin));
}

void note_color_configuration(Context& ctx) {
    const auto value = ctx.stage.metadata("colorConfiguration");
    if (!value) return;
    std::string name = text_of(value);
    if (const auto* asset = value->get_if<usd::layer::AssetPath>()) name = asset->path;
    if (!name.empty())
        ctx.diagnostics.note("color-configuration", ctx.stage.pseudo_root().loc(), "",
                             fmt::format("colorConfiguration {} is not read; color space names are "
                                         "those of docs/reference/usd_support.md",
                                         name));
}

}  // namespace velatura::translate::color
