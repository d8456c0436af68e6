// SPDX-License-Identifier: Apache-2.0
#include "app/products.h"

#include "app/render_job.h"
#include "base/asset_roots.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

namespace velatura::app {

namespace {

using scene::RenderProduct;
using scene::RenderSettings;

const scene::Provenance& place_of(const scene::Scene& scene, const RenderProduct& product) {
    static const scene::Provenance unknown;
    return product.provenance < scene.provenance.size() ? scene.provenance[product.provenance]
                                                        : unknown;
}

std::string prim_name(const scene::Scene& scene, const RenderProduct& product) {
    const std::string& path = place_of(scene, product).prim_path;
    return path.substr(path.rfind('/') + 1);
}

void warn(const scene::Scene& scene,
          const RenderProduct& product,
          const std::string& message,
          Diagnostics& diagnostics) {
    const scene::Provenance& place = place_of(scene, product);
    diagnostics.warn("render-products", place.loc, place.prim_path, message);
}

/// A confined scene does not choose the folder.
std::string name_of(const scene::Scene& scene,
                    const RenderProduct& product,
                    Diagnostics& diagnostics) {
    std::filesystem::path name = product.name;
    if (asset_roots().is_confined() && name.has_parent_path()) {
        warn(scene, product,
             fmt::format("product \"{}\" names a folder, which a confined scene cannot choose; "
                         "writing {}; set the output with -o",
                         name.string(), name.filename().string()),
             diagnostics);
        name = name.filename();
    }
    if (has_exr_extension(name.string())) return name.string();
    warn(scene, product,
         fmt::format("product \"{}\" is not the name of an OpenEXR file; writing {}.exr",
                     name.string(), name.string()),
         diagnostics);
    return name.string() + ".exr";
}

/// Whether the file of a product before it, with another view, would have its name.
bool is_name_taken(const RenderSettings& settings, size_t index) {
    const RenderProduct& product = settings.products[index];
    return std::any_of(
        settings.products.begin(), settings.products.begin() + std::ptrdiff_t(index),
        [&](const RenderProduct& p) { return p.name == product.name && p.view != product.view; });
}

}  // namespace

std::optional<size_t> next_view(const RenderSettings& settings) {
    for (size_t i = settings.product + 1; i < settings.products.size(); ++i) {
        const auto end = settings.products.begin() + std::ptrdiff_t(i);
        const bool is_known = std::any_of(settings.products.begin(), end, [&](const auto& p) {
            return p.view == settings.products[i].view;
        });
        if (!is_known) return i;
    }
    return std::nullopt;
}

OutputNames output_names(const RenderArguments& arguments,
                         const scene::Scene& scene,
                         Diagnostics& diagnostics) {
    const RenderSettings& settings = scene.settings;
    OutputNames names;
    const bool is_first = settings.product == 0;
    if (!is_first) names.suffix = prim_name(scene, settings.products[settings.product]);
    if (!arguments.output.empty()) {
        names.first = arguments.output;
        if (settings.products.size() > 1)
            diagnostics.warn("render-products", {}, settings.name,
                             fmt::format("{} render products, and --output names one file: the "
                                         "first product is rendered, with the layers of those that "
                                         "share its view",
                                         settings.products.size()));
        return names;
    }
    const std::string of_scene = std::filesystem::path(arguments.scene).stem().string() + ".exr";
    if (settings.products.empty()) {
        names.first = of_scene;
        return names;
    }
    for (size_t i = settings.product; i < settings.products.size(); ++i) {
        const RenderProduct& product = settings.products[i];
        if (product.view != settings.products[settings.product].view) continue;
        std::string name;
        if (!product.name.empty()) {
            std::filesystem::path path = name_of(scene, product, diagnostics);
            if (is_name_taken(settings, i)) {
                path.replace_extension("." + prim_name(scene, product) + ".exr");
                warn(scene, product,
                     fmt::format("an earlier product has the name \"{}\" and another view; "
                                 "writing {}",
                                 product.name, path.string()),
                     diagnostics);
            }
            name = path.string();
        } else {
            name = i == 0 ? of_scene : prim_name(scene, product) + ".exr";
        }
        const bool is_known =
            name == names.first ||
            std::find(names.others.begin(), names.others.end(), name) != names.others.end();
        if (names.first.empty())
            names.first = name;
        else if (!is_known)
            names.others.push_back(name);
    }
    return names;
}

}  // namespace velatura::app
