// SPDX-License-Identifier: Apache-2.0
#include "app/image_needs.h"

#include "app/frame_settings.h"
#include "app/render_layers.h"
#include "base/tasks.h"
#include "integrator/light_image.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <string>
#include <utility>
#include <vector>

namespace velatura::app {

namespace {

/// Light layers that the families of the set make, all of them lit.
struct LayerCounts {
    int as_chosen = 0;  ///< half, or float with --float-layers
    int as_float = 0;   ///< must give back every bit
};

LayerCounts layer_counts(const film::LayerSet& l) {
    const int groups = l.group_count(), columns = l.bounce_count();
    LayerCounts n;
    if (l.matrix_layers) n.as_chosen += groups * columns;
    if (l.bounce_layers) n.as_chosen += columns;
    if (l.group_layers) n.as_chosen += groups;
    const int lobes = int(l.lobes().size());
    // Emission is of bounce 0 alone, the others of all later ones
    if (lobes > 0) n.as_chosen += groups * (1 + (columns - 1) * (lobes - 1));
    n.as_chosen += int(l.path_layers.size()) - lobes;
    // Of each of these there may be one that a clamp touched
    if (l.has_clamp()) n.as_float += n.as_chosen;
    if (l.shadow_layers) n.as_chosen += groups;
    // Shadows are folds of what their casters take
    if (l.shadow_layers) (l.caster_layers ? n.as_float : n.as_chosen) += groups;
    if (l.caster_layers) n.as_chosen += groups * (int(l.casters.size()) + 1);
    constexpr int of_beauty = 2;
    if (l.halves) n.as_chosen += 2 * (n.as_chosen + n.as_float) + of_beauty;
    return n;
}

/// Channels of a file, by how they are stored.
struct ChannelCounts {
    int light_layers = 0;
    int as_chosen = 0;  ///< half, or float with --float-layers
    int as_half = 0, as_float = 0;

    int total() const { return as_chosen + as_half + as_float; }
};

ChannelCounts channel_counts(const film::LayerSet& layers) {
    constexpr int data_channels = 19, rgba_channels = 4;
    const LayerCounts counts = layer_counts(layers);
    // Of a Cryptomatte: a preview, and ids and coverages by pairs
    const int mattes = int(std::count(layers.mattes.begin(), layers.mattes.end(), true));
    ChannelCounts n;
    n.light_layers = counts.as_chosen + counts.as_float;
    n.as_chosen = 3 * counts.as_chosen;
    n.as_half = 3 * mattes;
    int named = 0;
    for (const accumulate::DataLayer& d : layers.named_data) named += int(d.width());
    n.as_float = named + rgba_channels + 3 * (counts.as_float + int(layers.data_aliases.size())) +
                 (layers.data_layers ? data_channels : 0) +
                 4 * ((layers.matte_levels + 1) / 2) * mattes;
    return n;
}

/// Pixels of the data window, of all channels as they are stored before compression.
ImageNeeds::File expected_file(const RenderJob& job, const FrameInput& input) {
    const film::LayerSet layers = layers_of(job, input.scene);
    const uint64_t pixels =
        uint64_t(data_window(input.scene.settings, job.arguments.crop).pixel_count());
    const ChannelCounts counts = channel_counts(layers);
    ImageNeeds::File file;
    file.name = input.output;
    file.layers = counts.light_layers;
    file.channels = counts.total();
    file.max_bytes = pixels * (uint64_t(counts.as_chosen) * (layers.float_layers ? 4 : 2) +
                               uint64_t(counts.as_half) * 2 + uint64_t(counts.as_float) * 4);
    file.sums_bytes = keeps_final_sums(job)
                          ? accumulate::SampleSums::expected_bytes(
                                data_window(input.scene.settings, job.arguments.crop), layers)
                          : 0;
    return file;
}

/// What could be left out, and how.
struct Saving {
    const char* what;
    void (*omit)(film::LayerSet&);
};

constexpr Saving savings[] = {
    {"--halves", [](film::LayerSet& l) { l.halves = false; }},
    {"caster of --layers", [](film::LayerSet& l) { l.caster_layers = false; }},
    {"matrix of --layers", [](film::LayerSet& l) { l.matrix_layers = false; }},
    {"shadow (with caster) of --layers",
     [](film::LayerSet& l) { l.shadow_layers = l.caster_layers = false; }},
    {"lobe-matrix of --layers",
     [](film::LayerSet& l) {
         std::erase_if(l.path_layers, [](const accumulate::PathLayer& p) {
             return p.family == accumulate::lobe_matrix_family;
         });
     }},
    {"lobe of --layers and --lpe",
     [](film::LayerSet& l) {
         std::erase_if(l.path_layers, [](const accumulate::PathLayer& p) {
             return p.family != accumulate::lobe_matrix_family;
         });
     }},
    {"bounces past --bounces 2",
     [](film::LayerSet& l) { l.last_bounce = std::min(l.last_bounce, 2); }},
    {"--cryptomatte", [](film::LayerSet& l) { l.mattes.fill(false); }},
};

ImageNeeds::File expected_deep_file(const RenderJob& job, const FrameInput& input) {
    ImageNeeds::File file;
    file.name = film::deep_path(input.output);
    file.channels = 6;
    // And the background
    const uint64_t max = uint64_t(job.settings.deep->max_samples) + 1;
    file.max_bytes = uint64_t(data_window(input.scene.settings, job.arguments.crop).pixel_count()) *
                     (sizeof(uint32_t) + max * sizeof(layers::DeepSample));
    return file;
}

/// Sums that a pixel keeps of each layer once it has all samples: one for each power of two of
/// their number.
uint64_t nodes_of(const RenderJob& job) {
    constexpr uint64_t usual = 4;
    if (job.settings.schedule.is_open_ended) return usual;
    return uint64_t(std::popcount(job.settings.schedule.end_sample));
}

/// Beside the film, while a file is written: its pixels, and rows of them on the way to the disk
/// and back. OpenEXR keeps two chunks for each of its threads for writing, and two compressed and
/// uncompressed for reading (Imf::OutputFile, InputFile).
uint64_t writing_bytes(uint64_t pixel_bytes, int rows) {
    constexpr uint64_t chunk_rows = 16, chunks_per_thread = 6, of_small_things = uint64_t(20) << 20;
    const uint64_t rows_on_the_way = chunk_rows * chunks_per_thread * uint64_t(thread_count());
    return pixel_bytes + pixel_bytes / uint64_t(std::max(rows, 1)) * rows_on_the_way +
           of_small_things;
}

}  // namespace

void warn_of_many_channels(const RenderJob& job,
                           const FrameInput& input,
                           Diagnostics& diagnostics) {
    const film::LayerSet layers = layers_of(job, input.scene);
    const int count = channel_counts(layers).total();
    if (count <= max_host_channels) return;
    std::vector<std::pair<int, std::string>> less;
    for (const Saving& saving : savings) {
        film::LayerSet fewer = layers;
        saving.omit(fewer);
        const int saved = count - channel_counts(fewer).total();
        if (saved > 0) less.emplace_back(saved, fmt::format("{} {}", saved, saving.what));
    }
    std::stable_sort(less.begin(), less.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    std::string text;
    for (const auto& [saved, what] : less) text += (text.empty() ? "" : ", ") + what;
    diagnostics.warn(
        "many-channels", {}, {},
        fmt::format("the file has up to {} channels, above Nuke's maximum of {}; {} can be "
                    "omitted; --lights groups and --casters reduce the light groups and casters",
                    count, max_host_channels, text));
}

namespace {

/// Whether light tracing is used is known after the trial paths only.
uint64_t splat_bytes(const RenderJob& job, const FrameInput& input) {
    using integrator::Caustics;
    const Caustics caustics = job.settings.caustics;
    if ((caustics != Caustics::Light && caustics != Caustics::Auto) ||
        !integrator::CausticPaths::can_exist(input.scene))
        return 0;
    const scene::RenderSettings& s = input.scene.settings;
    const double photons =
        integrator::LightEmission().photons_per_pixel * double(s.width) * double(s.height);
    return integrator::LightImage::expected_bytes(
        uint64_t(data_window(s, job.arguments.crop).pixel_count()), uint64_t(photons),
        sampling::PixelFilter(job.settings.tracer.filter).radius(),
        !layers_of(job, input.scene).path_layers.empty(), job.settings.schedule.end_sample);
}

}  // namespace

ImageNeeds image_needs(const RenderJob& job, const FrameInput& input) {
    ImageNeeds needs;
    needs.files = {expected_file(job, input)};
    const image::Window window = data_window(input.scene.settings, job.arguments.crop);
    if (job.settings.deep) needs.files.push_back(expected_deep_file(job, input));
    const uint64_t sums =
        accumulate::SampleSums::expected_bytes(window, layers_of(job, input.scene)) * nodes_of(job);
    needs.film_bytes = sums + (job.settings.deep ? film::DeepFilm::expected_bytes(window) : 0);
    needs.splat_bytes = splat_bytes(job, input);
    needs.writing_bytes = writing_bytes(
        needs.files.front().max_bytes + (keeps_sums(job) ? sums : 0), window.height());
    return needs;
}

}  // namespace velatura::app
