// SPDX-License-Identifier: Apache-2.0
#include "translate/settings.h"

#include "translate/color/named_color_space.h"
#include "translate/context/values.h"
#include "translate/geometry/primvars.h"
#include "translate/materials/materials.h"
#include "translate/translate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

namespace velatura::translate {

namespace {

constexpr int largest_side = 65536;  ///< pixels

/// Filters of render vars: ours, Karma's, RenderMan's, Arnold's.
constexpr const char* filter_attributes[] = {
    "velatura:filter",     "driver:parameters:aov:filter", "driver:parameters:aov:rule",
    "ri:accumulationRule", "ri:displayChannel:filter",     "arnold:filter"};

/// Where the resolution was read, with what was authored there.
struct AuthoredResolution {
    Attribute attribute;
    double width = 0, height = 0;

    bool is_good() const {
        // False for what is not a number
        return width >= 1 && width <= largest_side && height >= 1 && height <= largest_side;
    }
};

void read_resolution(Context& ctx,
                     Prim prim,
                     scene::RenderSettings& out,
                     std::optional<AuthoredResolution>& source) {
    const Attribute attribute = prim.attribute("resolution");
    const auto size = read_vector(attribute, 2, ctx.time);
    if (!size) {
        ctx.warn("bad-resolution", attribute,
                 fmt::format("resolution is not a pair of numbers, {} x {} is used", out.width,
                             out.height));
        return;
    }
    source = AuthoredResolution{attribute, (*size)[0], (*size)[1]};
    if (!source->is_good()) return;
    out.width = int(source->width);
    out.height = int(source->height);
}

void read_data_window(Context& ctx, Prim prim, scene::RenderSettings& out) {
    const Attribute attribute = prim.attribute("dataWindowNDC");
    const auto window = read_vector(attribute, 4, ctx.time);
    const auto finite = [](double v) { return std::isfinite(v); };
    if (window && std::all_of(window->begin(), window->end(), finite)) {
        std::copy_n(window->begin(), 4, out.data_window_ndc.begin());
        return;
    }
    const auto& w = out.data_window_ndc;
    ctx.warn("bad-data-window", attribute,
             fmt::format("dataWindowNDC is not four finite numbers, ({}, {}, {}, {}) is used", w[0],
                         w[1], w[2], w[3]));
}

/// disableMotionBlur, else the attribute that it replaced; nothing if neither is authored.
std::optional<bool> disables_motion_blur(Prim settings, usd::stage::TimeCode time) {
    for (const char* name : {"disableMotionBlur", "instantaneousShutter"})
        if (const Attribute attribute = settings.attribute(name); attribute.has_authored_value())
            return read_bool(attribute, false, time);
    return std::nullopt;
}

/// What RenderSettingsBase declares, taken only where the prim authors it. A resolution that cannot
/// be rendered stays in `resolution` alone.
void read_base(Context& ctx,
               Prim prim,
               scene::RenderSettings& out,
               std::optional<AuthoredResolution>& resolution) {
    const TimeCode time = ctx.time;
    const auto authored = [&](std::string_view name) {
        return prim.attribute(name).has_authored_value();
    };
    if (authored("resolution")) read_resolution(ctx, prim, out, resolution);
    if (authored("pixelAspectRatio")) {
        const double ratio = read_number(prim.attribute("pixelAspectRatio"), 1.0, time);
        if (ratio > 0.0 && std::isfinite(ratio))
            out.pixel_aspect_ratio = ratio;
        else
            ctx.warn("bad-pixel-aspect", prim.attribute("pixelAspectRatio"),
                     fmt::format("pixelAspectRatio {} is not a positive number, {} is used", ratio,
                                 out.pixel_aspect_ratio));
    }
    if (authored("aspectRatioConformPolicy"))
        out.aspect_conform = read_text(prim.attribute("aspectRatioConformPolicy"), "", time);
    if (authored("dataWindowNDC")) read_data_window(ctx, prim, out);
    if (const auto disabled = disables_motion_blur(prim, time)) out.disable_motion_blur = *disabled;
    if (authored("disableDepthOfField"))
        out.disable_depth_of_field = read_bool(prim.attribute("disableDepthOfField"), false, time);
    const Relationship camera = prim.relationship("camera");
    if (camera.has_authored_targets()) {
        const auto targets = camera.forwarded_targets();
        if (!targets.empty()) out.camera = targets[0].to_string();
    }
}

/// How samples become a pixel, as the first of these attributes says that is authored.
std::string read_filter(Context& ctx, Prim prim) {
    for (const char* name : filter_attributes) {
        const std::string filter = read_text(prim.attribute(name), "", ctx.time);
        if (!filter.empty()) return filter;
    }
    return {};
}

scene::RenderVar read_var(Context& ctx, Prim prim) {
    scene::RenderVar var;
    var.name = read_text(prim.attribute("driver:parameters:aov:name"), "", ctx.time);
    // The layer's name in files, as husk has it
    const std::string prefix =
        read_text(prim.attribute("driver:parameters:aov:channel_prefix"), "", ctx.time);
    if (!prefix.empty()) var.name = prefix;
    if (var.name.empty()) var.name = prim.name().str();
    var.source_name = read_text(prim.attribute("sourceName"), "", ctx.time);
    var.source_type = read_text(prim.attribute("sourceType"), "raw", ctx.time);
    const Attribute type = prim.attribute("dataType");
    if (type.has_authored_value()) var.data_type = read_text(type, "", ctx.time);
    var.filter = read_filter(ctx, prim);
    var.provenance = ctx.provenance(prim);
    if (var.source_type == "primvar" || var.source_type == "raw") {
        // What a raw var asks for may turn out to be a primvar
        const std::string& source = var.source_name.empty() ? var.name : var.source_name;
        constexpr std::string_view space = "primvars:";
        geometry::RequestedPrimvars& primvars = ctx.state<geometry::RequestedPrimvars>();
        primvars.names.insert(source.starts_with(space) ? source.substr(space.size()) : source);
        primvars.lists_all = true;
    }
    if (var.source_type == "intrinsic") {
        ctx.warn("unsupported-render-var", prim,
                 "render var of sourceType intrinsic is not supported, it gets no channel");
    }
    return var;
}

scene::RenderProduct read_product(Context& ctx, Prim prim) {
    scene::RenderProduct product;
    product.name = read_text(prim.attribute("productName"), "", ctx.time);
    product.provenance = ctx.provenance(prim);
    const std::string type = read_text(prim.attribute("productType"), "raster", ctx.time);
    if (type != "raster") {
        ctx.warn("unsupported-product-type", prim.attribute("productType"),
                 fmt::format("productType {} is not supported, raster is written", type));
    }
    for (const auto& path : prim.relationship("orderedVars").forwarded_targets()) {
        const Prim var = ctx.stage.prim_at(path);
        if (var && var.is_a("RenderVar")) {
            product.vars.push_back(read_var(ctx, var));
        } else {
            ctx.warn("unknown-render-var", prim,
                     fmt::format("orderedVars target <{}> is not a RenderVar", path.to_string()));
        }
    }
    return product;
}

/// What a product's samples depend on, as text.
std::string view_of(const scene::RenderSettings& s, const TranslateOptions& options) {
    const auto& w = s.data_window_ndc;
    const int width = options.resolution ? (*options.resolution)[0] : s.width;
    const int height = options.resolution ? (*options.resolution)[1] : s.height;
    return fmt::format("{} {}x{} {} {} {} {} {} {} {} {}",
                       options.camera.empty() ? s.camera : options.camera, width, height,
                       s.pixel_aspect_ratio, s.aspect_conform, w[0], w[1], w[2], w[3],
                       s.disable_depth_of_field, s.disable_motion_blur);
}

void read_products(Context& ctx,
                   Prim prim,
                   const TranslateOptions& options,
                   scene::RenderSettings& out,
                   std::optional<AuthoredResolution>& resolution) {
    const scene::RenderSettings settings_alone = out;
    for (const auto& path : prim.relationship("products").forwarded_targets()) {
        const Prim product = ctx.stage.prim_at(path);
        if (!product || !product.is_a("RenderProduct")) {
            ctx.warn("unknown-render-product", prim,
                     fmt::format("products target <{}> is not a RenderProduct", path.to_string()));
            continue;
        }
        out.products.push_back(read_product(ctx, product));
        scene::RenderSettings overridden = settings_alone;
        std::optional<AuthoredResolution> own;
        read_base(ctx, product, overridden, own);
        out.products.back().view = view_of(overridden, options);
        if (out.products.size() != options.product + 1) continue;
        std::vector<scene::RenderProduct> products = std::move(out.products);
        out = std::move(overridden);
        out.products = std::move(products);
        out.product = options.product;
        if (own) resolution = own;
    }
}

/// The render passes of the stage, for messages.
std::string named_passes(const Context& ctx) {
    std::string text;
    usd::stage::traverse(ctx.stage.pseudo_root(), [&](Prim prim) {
        if (prim.is_a("RenderPass"))
            text += (text.empty() ? "; passes of the stage: <" : ", <") + prim.path_string() + ">";
        return !prim.is_instance();
    });
    return text.empty() ? "; the stage has no RenderPass" : text;
}

/// Reads the collections of a render pass, which say what is rendered and how.
void read_render_pass(Context& ctx, Prim pass) {
    using usd::stage::CollectionQuery;
    ctx.scene.settings.pass = pass.path_string();
    RenderPass& read = ctx.rendered.pass.emplace(
        RenderPass{CollectionQuery(pass, "renderVisibility"), CollectionQuery(pass, "prune")});
    CollectionQuery seen(pass, "cameraVisibility"), mattes(pass, "matte");
    const bool hides = seen.has_expression() || seen.rule_paths().size() > 1 ||
                       !seen.includes(ctx.stage.pseudo_root().path());
    if (hides) read.camera_visible = std::move(seen);
    if (!mattes.is_empty()) read.mattes = std::move(mattes);
}

/// The settings that a render pass renders with.
Prim render_source(Context& ctx, Prim pass) {
    const auto sources = pass.relationship("renderSource").forwarded_targets();
    const Prim settings = sources.empty() ? Prim() : ctx.stage.prim_at(sources.front());
    if (settings && settings.is_a("RenderSettings")) return settings;
    ctx.warn("unknown-settings", pass,
             "renderSource names no RenderSettings of the stage, fallbacks are used");
    return Prim();
}

/// The settings that the options, a render pass or else the stage choose.
Result<Prim> settings_prim(Context& ctx, const TranslateOptions& options) {
    const auto prim_of = [&](const std::string& path, std::string_view type) {
        const Prim prim = ctx.stage.prim_at(path);
        return prim && prim.is_a(type) ? prim : Prim();
    };
    Prim pass;
    if (!options.pass.empty()) {
        pass = prim_of(options.pass, "RenderPass");
        if (!pass)
            return Error{"unknown-pass", fmt::format("<{}> is not a RenderPass{}", options.pass,
                                                     named_passes(ctx))};
        read_render_pass(ctx, pass);
    }
    if (!options.settings.empty()) {
        if (const Prim prim = prim_of(options.settings, "RenderSettings")) return prim;
        const Prim named = prim_of(options.settings, "RenderPass");
        if (!named || pass)
            return Error{"unknown-settings", fmt::format("<{}> is {}", options.settings,
                                                         pass ? "not a RenderSettings"
                                                              : "neither a RenderSettings nor a "
                                                                "RenderPass")};
        read_render_pass(ctx, named);
        pass = named;
    }
    if (pass) return render_source(ctx, pass);
    const auto value = ctx.stage.metadata("renderSettingsPrimPath");
    if (!value) return Prim();
    std::string path;
    if (const auto* s = value->get_if<std::string>()) path = *s;
    if (const auto* t = value->get_if<usd::layer::Token>()) path = t->str();
    if (path.empty()) return Prim();
    const Prim prim = prim_of(path, "RenderSettings");
    if (!prim)
        ctx.diagnostics.warn("unknown-settings", ctx.stage.pseudo_root().loc(), path,
                             "renderSettingsPrimPath names no RenderSettings, fallbacks are used");
    return prim;
}

/// Error for a resolution that cannot be rendered; asked for by the options, else authored.
std::optional<Error> check_resolution(Context& ctx,
                                      const TranslateOptions& options,
                                      const std::optional<AuthoredResolution>& authored) {
    scene::RenderSettings& out = ctx.scene.settings;
    AuthoredResolution used;
    if (options.resolution) {
        used.width = (*options.resolution)[0];
        used.height = (*options.resolution)[1];
    } else if (authored) {
        used = *authored;
    } else {
        return std::nullopt;
    }
    const bool is_by_camera = options.resolution && used.height == 0;
    if (used.is_good() || (is_by_camera && used.width >= 1 && used.width <= largest_side)) {
        out.width = int(used.width);
        out.height = int(used.height);
        return std::nullopt;
    }
    std::string place;
    if (used.attribute.is_valid()) {
        const SourceLoc loc = used.attribute.loc();
        place = fmt::format(" ({}:{}:{}, <{}>)", ctx.diagnostics.file_name(loc.file_id), loc.line,
                            loc.column, used.attribute.path_string());
    }
    return Error{"bad-resolution", fmt::format("resolution {} x {}, expected 1 to {} each way{}",
                                               used.width, used.height, largest_side, place)};
}

/// Chooses for a stage that names no settings, and says what. Motion blur is off where all settings
/// of the stage are for an instantaneous shutter: what its cameras say is then not meant.
void choose_without_settings(Context& ctx) {
    std::string first;
    bool are_instantaneous = true;
    usd::stage::traverse(ctx.stage.pseudo_root(), [&](Prim prim) {
        if (prim.is_a("RenderSettings")) {
            if (first.empty()) first = prim.path_string();
            are_instantaneous =
                are_instantaneous && disables_motion_blur(prim, ctx.time).value_or(false);
        }
        return !prim.is_instance();
    });
    scene::RenderSettings& out = ctx.scene.settings;
    out.disable_motion_blur = !first.empty() && are_instantaneous;
    const std::string why =
        first.empty()
            ? "the stage has no RenderSettings"
            : fmt::format("renderSettingsPrimPath is not set; choose with --settings {}", first);
    ctx.diagnostics.note(
        "no-render-settings", {}, "",
        fmt::format("{}: {}the other defaults are used{}", why,
                    out.height > 0 ? fmt::format("{} x {} pixels and ", out.width, out.height)
                                   : std::string(),
                    out.disable_motion_blur ? ", but motion blur is off as there" : ""));
}

/// The space of all colors: the option's, else the one that the settings name.
Result<void> choose_working_space(Context& ctx, Prim settings, const TranslateOptions& options) {
    const Attribute authored = settings ? settings.attribute("renderingColorSpace") : Attribute();
    const bool is_option = !options.working_space.empty();
    const std::string name = is_option             ? options.working_space
                             : authored.is_valid() ? read_text(authored, "", ctx.time)
                                                   : std::string();
    const auto working = color::WorkingSpace::named(name);
    if (working) {
        ctx.state<color::WorkingSpace>() = *working;
        ctx.scene.settings.working_space = working->id();
        return {};
    }
    const std::string expected = fmt::format("expected one of {}", color::WorkingSpace::choices());
    if (is_option)
        return Error{"unknown-working-space",
                     fmt::format("working space '{}' is not supported; {}", name, expected)};
    ctx.warn("unsupported-color-space", authored,
             fmt::format("renderingColorSpace {} is not supported, linear Rec.709 is used; {}",
                         name, expected));
    return {};
}

}  // namespace

Result<void> read_render_settings(Context& ctx, const TranslateOptions& options) {
    scene::RenderSettings& out = ctx.scene.settings;
    const Result<Prim> chosen = settings_prim(ctx, options);
    if (!chosen) return chosen.error();
    const Prim prim = *chosen;
    std::optional<AuthoredResolution> resolution;
    if (prim) {
        out.name = prim.path_string();
        out.provenance = ctx.provenance(prim);
        read_base(ctx, prim, out, resolution);
        if (prim.attribute("includedPurposes").has_authored_value())
            out.included_purposes = read_texts(prim.attribute("includedPurposes"), ctx.time);
        if (prim.attribute("materialBindingPurposes").has_authored_value())
            out.material_binding_purposes =
                read_texts(prim.attribute("materialBindingPurposes"), ctx.time);
        read_products(ctx, prim, options, out, resolution);
    }
    if (auto space = choose_working_space(ctx, prim, options); !space) return space.error();
    if (auto error = check_resolution(ctx, options, resolution)) return *std::move(error);
    // A name that leads nowhere was warned of
    if (!prim && !ctx.rendered.pass && !ctx.stage.metadata("renderSettingsPrimPath"))
        choose_without_settings(ctx);
    if (!options.purposes.empty()) out.included_purposes = options.purposes;
    ctx.rendered.purposes.insert(out.included_purposes.begin(), out.included_purposes.end());
    auto& bindings = out.material_binding_purposes;
    if (!options.material_purpose.empty()) bindings = {options.material_purpose};
    auto& material_purposes = ctx.state<materials::TranslatedMaterials>().purposes;
    material_purposes.clear();
    for (const std::string& purpose : bindings)
        material_purposes.push_back(purpose == "allPurpose" ? "" : purpose);
    return {};
}

}  // namespace velatura::translate
