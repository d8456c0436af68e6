// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/data_requests.h"
#include "app/progress.h"
#include "app/render_arguments.h"
#include "base/result.h"
#include "display/terminal_image.h"
#include "display/tev_connection.h"
#include "film/film.h"
#include "render/settings.h"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace velatura::app {

/// The command line of a render, checked and with the scene's own settings filled in; the same for
/// every frame.
struct RenderJob {
    RenderArguments arguments;
    render::Settings settings;           ///< layers without groups
    std::vector<DataRequest> data;       ///< of --layers
    std::string light_sampling = "mis";  ///< as the option names it
    std::string light_selection_name = "tree";
    layers::Layout layout = layers::Layout::MultiPart;
    image::Compression compression = image::Compression::Zip;
    ProgressStyle progress = ProgressStyle::Bar;

    /// A pixel whose samples are traced again, instead of a render.
    struct Replay {
        uint64_t x = 0, y = 0;
        std::optional<uint64_t> sample;  ///< nothing: all
    };

    std::optional<Replay> replay;
    std::optional<display::Address> display;  ///< of a viewer
    std::vector<std::string> display_layers;
    std::optional<display::TerminalProtocol> terminal;  ///< of ProgressStyle::Image
    double preview_interval_s = 5;
};

/// Whether files of a render that is not finished hold the exact sums: to be gone on from.
bool keeps_sums(const RenderJob& job);

/// Whether the finished file holds them, too, which --snapshot alone does not ask for.
bool keeps_final_sums(const RenderJob& job);

/// Checks values and combinations of options. Errors: "usage" (exit 2).
Result<RenderJob> make_render_job(const RenderArguments& arguments);

/// Whether the name ends in .exr, in whatever case: the only format a render is written in.
bool has_exr_extension(const std::string& path);

}  // namespace velatura::app
