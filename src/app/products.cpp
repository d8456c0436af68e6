// SPDX-License-Identifier: Apache-2.0
#include "app/products.h"

#include "app/render_job.h"
#include "base/asset_roots.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>

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

/// The file of a product by itself. A confined scene does not choose the folder. report(text):
/// what is not as the scene has it.
template <class Report>
std::string own_name(const RenderProduct& product,
                     const std::string& without_name,
                     const Report& report) {
    if (product.name.empty()) return without_name;
    std::filesystem::path name = product.name;
    if (asset_roots().is_confined() && name.has_parent_path()) {
        report(
            fmt::format("product \"{}\" names a folder, which a confined scene cannot choose; "
                        "writing {}; set the output with -o",
                        name.string(), name.filename().string()));
        name = name.filename();
    }
    if (has_exr_extension(name.string())) return name.string();
    report(fmt::format("product \"{}\" is not the name of an OpenEXR file; writing {}.exr",
                       name.string(), name.string()));
    return name.string() + ".exr";
}

/// A name that no product of another view has.
std::string free_name(const std::string& name,
                      const std::string& prim,
                      const std::string& view,
                      const std::map<std::string, std::string>& views) {
    const auto is_free = [&](const std::string& n) {
        const auto at = views.find(n);
        return at == views.end() || at->second == view;
    };
    std::string out = name;
    for (int i = 1; !is_free(out); ++i) {
        std::filesystem::path path = name;
        path.replace_extension(i == 1 ? fmt::format(".{}.exr", prim)
                                      : fmt::format(".{}_{}.exr", prim, i));
        out = path.string();
    }
    return out;
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
    const std::string& view = settings.products[settings.product].view;
    std::map<std::string, std::string> views;  // name of a file → view of its products
    for (size_t i = 0; i < settings.products.size(); ++i) {
        const RenderProduct& product = settings.products[i];
        const auto report = [&](const std::string& message) {
            if (product.view == view) warn(scene, product, message, diagnostics);
        };
        const std::string prim = prim_name(scene, product);
        const std::string own = own_name(product, i == 0 ? of_scene : prim + ".exr", report);
        const std::string name = free_name(own, prim, product.view, views);
        if (name != own)
            report(
                fmt::format("an earlier product with another view is {}; writing {}", own, name));
        const bool is_new = views.emplace(name, product.view).second;
        if (product.view != view || !is_new) continue;
        if (names.first.empty())
            names.first = name;
        else
            names.others.push_back(name);
    }
    return names;
}

}  // namespace velatura::app
