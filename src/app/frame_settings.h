// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/render_frame.h"

#include <nlohmann/json_fwd.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace velatura::app {

/// What beside the layers of the scene, the samples, the layer set and the data window changes
/// pixels: names and values, in a fixed order. Threads, tiles and mode do not.
using FrameSettings = std::vector<std::pair<std::string, std::string>>;

/// A file that the scene reads beside its layers.
struct SceneFile {
    std::string name;  ///< without its folder
    std::string hash;  ///< of its content; empty: it cannot be opened

    bool operator==(const SceneFile&) const = default;
};

/// Their paths.
std::vector<std::string> scene_file_paths(const scene::Scene& scene);

/// Reads each of them, in the order in which the scene names them: once per frame.
std::vector<SceneFile> scene_files(const scene::Scene& scene);

/// All but --guiding, which trial paths may decide. `files`: scene_files().
FrameSettings frame_settings(const RenderJob& job,
                             const FrameInput& input,
                             const std::vector<SceneFile>& files);

/// Of the settings with the layer set, not the window: files with another hash do not merge.
std::string settings_hash(const FrameSettings& settings, const film::LayerSet& layers);

/// The samples that a render was asked for, and whether its file has all of them.
struct PartState {
    uint64_t first = 0;
    std::optional<uint64_t> end;  ///< nothing: until a time or an error is reached
    bool is_complete = false;

    bool operator==(const PartState&) const = default;
};

/// What a file states of how it was rendered.
struct FrameFacts {
    FrameSettings settings;
    std::vector<SceneFile> files;
    PartState part;
    std::string top_ups = "[]";  ///< a JSON list: by which looks samples were placed
};

/// The header string `velatura/settings`: the facts, but for the part of a top-up, whose pixels
/// have counts of their own; which build rendered, what the render lacked (missing_asset_names()),
/// and how the error fell on the way to a target (observations_json; empty: not kept).
std::string settings_json(const FrameFacts& facts,
                          const std::vector<std::string>& lacks,
                          const nlohmann::ordered_json& error_curve);

/// The part of the image to render: data window of the settings cut by --crop; it may reach
/// beyond the image (overscan). Origin top left, in pixels. A pixel is in if its center is
/// (UsdRenderSettings dataWindowNDC).
image::Window data_window(const scene::RenderSettings& settings, const std::vector<double>& crop);

}  // namespace velatura::app
