// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/render_frame.h"

#include <nlohmann/json_fwd.hpp>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace velatura::app {

/// What beside the layers of the scene, the samples, the layer set and the data window changes
/// pixels: names and values, in a fixed order. Threads, tiles and mode do not.
using FrameSettings = std::vector<std::pair<std::string, std::string>>;

/// All but --guiding, which trial paths may decide. Reads every file that the scene refers to: once
/// per frame.
FrameSettings frame_settings(const RenderJob& job, const FrameInput& input);

/// Of the settings with layer set and window: files with another hash do not merge.
std::string settings_hash(const FrameSettings& settings,
                          const film::LayerSet& layers,
                          const image::Window& window);

/// The header string `velatura/settings`: the settings, from which sample on, which build rendered,
/// by which looks samples were placed (a JSON list), and how the error fell on the way to a target
/// (observations_json; empty: not kept).
std::string settings_json(const FrameSettings& settings,
                          uint64_t first_sample,
                          const std::string& top_ups,
                          const nlohmann::ordered_json& error_curve);

/// The part of the image to render: data window of the settings cut by --crop; it may reach
/// beyond the image (overscan). Origin top left, in pixels. A pixel is in if its center is
/// (UsdRenderSettings dataWindowNDC).
image::Window data_window(const scene::RenderSettings& settings, const std::vector<double>& crop);

}  // namespace velatura::app
