// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/asset_options.h"
#include "base/command_line.h"
#include "base/result.h"
#include "film/deep_film.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace velatura::app {

/// Samples per pixel where no option says how many.
inline constexpr uint64_t default_spp = 64;
/// The most without --spp where only --target-error, or --time, ends the render.
inline constexpr uint64_t max_target_spp = 65536, max_timed_spp = uint64_t(1) << 32;

/// The command line of `velatura render`, as typed.
struct RenderArguments {
    std::string scene;
    AssetOptions assets;
    std::string memory_limit;
    std::string output;
    std::string camera;
    std::string settings;
    std::string pass;
    std::string frames;
    std::vector<int> resolution;  ///< W H
    int image_width = 0;          ///< instead of `resolution`; 0: not given
    std::vector<double> crop;     ///< x0 x1 y0 y1, fractions of the image, origin bottom left
    std::string mode = "progressive";
    int tile = 32;
    std::optional<uint64_t> spp;
    std::string time;
    std::string target_error;
    bool requires_target = false;
    std::string forecast;  ///< an error
    std::string bounces = "6";
    int max_depth = 0;
    uint64_t seed = 0;
    std::string samples;     ///< A:B
    std::string rates_from;  ///< a file of earlier samples
    bool is_resumable = false;
    bool resume = false;
    std::string for_mix;  ///< a request of velatura-comp request
    std::string checkpoint;
    std::string lights = "per-light";
    std::string layers = "bounce,light,matrix,shadow,data";
    std::vector<std::string> casters;  ///< path expressions
    std::vector<std::string> lpe;      ///< NAME=EXPRESSION
    bool strict_lpe = false;
    bool halves = false;
    bool float_layers = false;
    std::string cryptomatte;  ///< object, material or both
    std::optional<int> matte_levels;
    std::string matte_through;  ///< refraction, reflection or both
    bool deep = false;
    std::optional<int> deep_samples;
    std::optional<double> clamp_direct, clamp_indirect;  ///< radiance
    std::string firefly_guard = "off";
    std::string exr_layout = "multipart";
    std::string exr_compression = "zip";
    std::string filter = "blackman-harris";
    std::string integrator = "path";
    std::string light_sampling;   ///< empty = what the integrator stands for
    std::string light_selection;  ///< empty = by the tree, by area where points of all lights are
    std::string roulette = "efficiency";
    std::optional<double> cutoff;  ///< of --roulette cutoff
    std::string adaptive = "on";
    std::string splitting = "auto";
    std::string guiding = "auto";
    std::string caustics = "auto";
    std::string sampler = "sobol";
    std::string effects;       ///< all, -name, or several
    double dicing_rate = 1.0;  ///< pixels
    std::optional<int> subdivision_level;
    double dicing_limit = 50;  ///< million triangles
    double texture_bias = 0;   ///< mip levels
    std::string volume_bounds = "bricks";
    std::optional<double> volume_memory_gb;  ///< nothing: half of the machine's
    std::optional<double> instance_limit;    ///< millions; nothing: by the machine's memory
    std::string accel = "bvh";
    std::string bvh_quality = "auto";
    int threads = 0;
    std::string snapshot;
    std::string progress = "bar";
    std::string stats;
    bool strict = false;
    bool requires_assets = false;
    std::string missing_textures = "fallback";
    std::string replay;  ///< x,y or x,y,s
    std::vector<std::string> paths;
    std::vector<std::string> purposes;
    std::string material_purpose;
    std::string working_space;  ///< empty: that of the render settings
    std::string display, display_layers;
    std::string preview, every;
    bool quiet = false;
    int verbosity = 0;
};

/// Declares the options on a subcommand; the strings are the text of --help.
void declare_render_options(Command& command, RenderArguments& arguments);

}  // namespace velatura::app
