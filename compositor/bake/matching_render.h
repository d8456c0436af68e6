// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/io/layer_stack.h"

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace velatura::compositor::bake {

/// An option of `velatura render` with its values.
struct RenderOption {
    std::string name;  ///< `--res`
    std::vector<std::string> values;

    bool operator==(const RenderOption&) const = default;
};

/// Options for an image like that of the file, as far as its header tells: resolution, window,
/// camera, frame, samples, light rows, and of `velatura/settings` filter, depth, purposes, dicing,
/// effects that were left out and the estimator; another seed. crop: x0 x1 y0 y1 in fractions from
/// the bottom left; none: the file's window.
std::vector<RenderOption> matching_render_options(const LayerStack& stack,
                                                  const std::optional<std::array<double, 4>>& crop);

/// Puts options in place of those of their names, after all others; one may be there several times.
void override_options(std::vector<RenderOption>& options, const std::vector<RenderOption>& by);

/// Options as they are typed on one line, without quotation marks: `--filter box --crop 0 1 0 1`.
/// Words before the first option are none's, and dropped.
std::vector<RenderOption> options_of(const std::string& line);

/// As a command line takes them.
std::vector<std::string> arguments_of(const std::vector<RenderOption>& options);

}  // namespace velatura::compositor::bake
