// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/render_arguments.h"
#include "base/diagnostics.h"
#include "scene/scene.h"

#include <optional>
#include <string>
#include <vector>

namespace velatura::app {

/// The first product after the settings' own that has a view of its own: camera, resolution and
/// the like. Nothing: there is none.
std::optional<size_t> next_view(const scene::RenderSettings& settings);

/// Names of the files of a render, without frame numbers.
struct OutputNames {
    std::string first;
    std::vector<std::string> others;  ///< of products with the same view: the same content
    std::string suffix;  ///< of files beside it, for products after the first; empty: none
};

/// By --output, else by the product's name, else by that of the scene, or of the product where it
/// is not the first. Products of one name and different views get the names of their prims behind.
/// Warnings: "render-products".
OutputNames output_names(const RenderArguments& arguments,
                         const scene::Scene& scene,
                         Diagnostics& diagnostics);

}  // namespace velatura::app
