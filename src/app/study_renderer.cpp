// SPDX-License-Identifier: Apache-2.0
#include "app/study_renderer.h"

#include "accumulate/pixel_means.h"
#include "app/frame_settings.h"
#include "app/progress.h"
#include "app/render_layers.h"
#include "app/render_settings.h"
#include "app/stats.h"
#include "app/stop_signals.h"
#include "app/study_outlines.h"
#include "base/command_line.h"
#include "base/hash.h"
#include "integrator/schedule.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <optional>

namespace velatura::app {

namespace {

/// Of all threads of the process.
double cpu_seconds() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

/// Where in the image the pixels of a grid lie: anywhere in their cells, the same for all renders
/// of the grid. Those of a region lie side by side.
class GridPixels {
  public:
    explicit GridPixels(const study::Region& region, const image::Window& window) {
        for (int j = 0; j < region.height; ++j) {
            for (int i = 0; i < region.width; ++i) {
                x_.push_back(window.x0 + region.x + i);
                y_.push_back(window.y0 + region.y + j);
            }
        }
    }

    GridPixels(const study::Grid& grid, const image::Window& window) {
        for (int j = 0; j < grid.height; ++j) {
            for (int i = 0; i < grid.width; ++i) {
                const uint64_t h = hash_combine(uint64_t(uint32_t(i)), uint64_t(uint32_t(j)));
                x_.push_back(place(window.x0, window.width(), grid.width, i, uint32_t(h)));
                y_.push_back(place(window.y0, window.height(), grid.height, j, uint32_t(h >> 32)));
            }
        }
    }

    int x(size_t i) const { return x_[i]; }

    int y(size_t i) const { return y_[i]; }

  private:
    static int place(int first, int size, int cells, int cell, uint32_t u) {
        const double at = (double(cell) + double(u) * 0x1p-32) * double(size) / double(cells);
        return first + std::min(int(at), size - 1);
    }

    std::vector<int> x_, y_;
};

std::vector<float> means_of(const accumulate::SampleSums& sums, uint32_t accumulator) {
    const image::Window& w = sums.window();
    std::vector<float> means;
    means.reserve(3 * w.pixel_count());
    for (int y = w.y0; y < w.y1; ++y) {
        for (int x = w.x0; x < w.x1; ++x) {
            const double weight =
                accumulate::weight_of(sums.total(x, y, accumulate::AccumulatorTable::coverage));
            const accumulate::Triple sum = sums.total(x, y, accumulator);
            for (const double v : {sum.x, sum.y, sum.z})
                means.push_back(weight == 0.0 ? 0.0f : float(v / weight));
        }
    }
    return means;
}

/// A layer that the film keeps, or keeps as the sum of others.
std::optional<study::LayerReading> layer_of(const film::Film& film,
                                            bool is_bounce,
                                            const std::string& name,
                                            uint32_t own,
                                            const std::vector<uint32_t>& parts) {
    study::LayerReading layer{is_bounce, name, {}};
    for (const uint32_t a :
         own != accumulate::AccumulatorTable::absent ? std::vector<uint32_t>{own} : parts) {
        if (a == accumulate::AccumulatorTable::absent || !film.sums().is_used(a)) continue;
        const std::vector<float> means = means_of(film.sums(), a);
        layer.means.resize(means.size(), 0.0f);
        for (size_t i = 0; i < means.size(); ++i) layer.means[i] += means[i];
    }
    return layer.means.empty() ? std::nullopt : std::optional(std::move(layer));
}

std::vector<study::LayerReading> layers_of_film(const film::Film& film) {
    const film::LayerSet& set = film.layer_set();
    const accumulate::AccumulatorTable& table = film.sums().table();
    std::vector<study::LayerReading> layers;
    for (int c = 0; c < set.bounce_count(); ++c) {
        std::vector<uint32_t> row;
        for (int g = 0; g < set.group_count(); ++g) row.push_back(table.matrix(c, g));
        if (auto layer = layer_of(film, true, set.column_name(c), table.bounce(c), row))
            layers.push_back(std::move(*layer));
    }
    for (int g = 0; g < set.group_count(); ++g) {
        std::vector<uint32_t> column;
        for (int c = 0; c < set.bounce_count(); ++c) column.push_back(table.matrix(c, g));
        if (auto layer = layer_of(film, false, set.groups[size_t(g)].name, table.group(g), column))
            layers.push_back(std::move(*layer));
    }
    return layers;
}

}  // namespace

StudyRenderer::StudyRenderer(const RenderJob& job,
                             const FrameInput& input,
                             Diagnostics& diagnostics)
    : job_(job),
      input_(input),
      diagnostics_(diagnostics),
      window_(data_window(input.scene.settings, job.arguments.crop)) {}

Result<RenderJob> StudyRenderer::job_with(const std::string& options) const {
    RenderArguments arguments = job_.arguments;
    if (!options.empty()) {
        // The options of the study's render stay where these do not say otherwise
        CommandLine parser("");
        declare_render_options(parser, arguments);
        const size_t gap = options.find(' ');
        const std::string option = options.substr(0, gap) + "=" + options.substr(gap + 1);
        if (const auto ended = parser.parse({arguments.scene, option}))
            return Error{"usage", ended->message};
    }
    Result<RenderJob> job = make_render_job(arguments);
    if (job) job->settings.world.accelerator = job_.settings.world.accelerator;
    return job;
}

std::string StudyRenderer::place_key(const RenderJob& job) const {
    std::string omitted;
    for (size_t e = 0; e < scene::effect_count; ++e)
        if (job.settings.omitted.has(scene::Effect(e)) &&
            !job_.settings.omitted.has(scene::Effect(e)))
            omitted += fmt::format("-{}", scene::info(scene::Effect(e)).name);
    const bool is_compensated =
        job.settings.tracer.estimator.light_sampling == integrator::LightSampling::Mis;
    return fmt::format("{} {} {} {} {} {} {} {} {}", job.arguments.texture_bias,
                       job.arguments.volume_bounds, omitted,
                       int(job.settings.world.light_selection), job.arguments.bvh_quality,
                       job.settings.world.dicing.rate, job.settings.world.dicing.level.value_or(-1),
                       is_compensated, job.settings.world.samples_light_area);
}

std::shared_ptr<const StudyRenderer::Place> StudyRenderer::find_place(const RenderJob& job) {
    const std::string key = place_key(job);
    if (const auto found = places_.find(key); found != places_.end()) return found->second;
    make_room();
    auto place = std::make_shared<Place>();
    const double start = cpu_seconds();
    const bool is_first = places_.empty();
    // What the scene has to say was said with the first world
    Diagnostics told_before;
    Diagnostics& diagnostics = is_first ? diagnostics_ : told_before;

    const scene::Scene* scene = &input_.scene;
    for (size_t e = 0; e < scene::effect_count; ++e) {
        if (!job.settings.omitted.has(scene::Effect(e)) ||
            job_.settings.omitted.has(scene::Effect(e)))
            continue;
        if (!place->scene) place->scene = std::make_unique<scene::Scene>(input_.scene);
        integrator::omit(*place->scene, scene::Effect(e));
        scene = place->scene.get();
    }
    render::Settings settings = render_settings(job, input_);
    const auto make_world = [&](Diagnostics& d) {
        render::Renderer renderer(*scene, settings);
        renderer.build(d);
        return renderer.shared_world();
    };
    place->world = make_world(diagnostics);
    place->setup_s = cpu_seconds() - start;
    if (is_first && place->setup_s < 10) {
        // What a process does only once, as loading libraries, every render pays for and no setting
        // saves
        const double again = cpu_seconds();
        place->world = make_world(told_before);
        once_s_ = std::max(0.0, place->setup_s - (cpu_seconds() - again));
        place->setup_s -= once_s_;
    }
    place->setup_s += once_s_;
    place->outline_px = outline_error_px(*place->world);
    place->bytes = place->world->geometry.bytes() + place->world->accelerator->stats().bytes;
    places_[key] = place;
    return place;
}

void StudyRenderer::make_room() {
    // Worlds are made again when there are too many for the memory; that of the render as it is
    // stays
    constexpr size_t max_bytes = size_t(2) << 30;
    size_t bytes = 0;
    for (const auto& [key, place] : places_) bytes += place->bytes;
    if (bytes < max_bytes) return;
    const std::string base = place_key(job_);
    std::erase_if(prepared_, [&](const auto& p) { return p.second->place_key != base; });
    std::erase_if(places_, [&](const auto& p) { return p.first != base; });
}

Result<std::shared_ptr<const StudyRenderer::Prepared>> StudyRenderer::prepare(
    const std::string& options) {
    if (const auto found = prepared_.find(options); found != prepared_.end()) return found->second;
    Result<RenderJob> job = job_with(options);
    if (!job) return job.error();
    auto p = std::make_shared<Prepared>();
    p->job = std::move(*job);
    p->place = find_place(p->job);
    p->place_key = place_key(p->job);
    const integrator::World& world = *p->place->world;
    if (const size_t unread = unread_textures(world);
        unread > 0 && job_.arguments.missing_textures == "error")
        return Error{"texture-failure", format_count(unread, "unreadable texture") +
                                            "; --missing-textures error studies nothing"};
    const std::atomic<bool>* stop = &StopSignals::stop_flag();

    const double start = cpu_seconds();
    render::Settings settings = render_settings(p->job, input_);
    settings.layers = layers_of(p->job, world.scene);
    p->renderer.emplace(p->place->world, std::move(settings));
    p->renderer->learn(stop);
    if (*stop) return Error{"stopped", "stopped"};
    p->setup_s = p->place->setup_s + cpu_seconds() - start;
    prepared_[options] = p;
    return std::shared_ptr<const Prepared>(p);
}

Result<study::RenderRun> StudyRenderer::render(const study::RenderRequest& request) {
    const Result<std::shared_ptr<const Prepared>> prepared = prepare(request.options);
    if (!prepared) return prepared.error();
    const Prepared& p = **prepared;
    film::Film film({0, 0, request.grid.width, request.grid.height}, p.renderer->layers(),
                    {.final_sample_end = integrator::max_samples(schedule_of(p, request))});
    return render_into(film, p, request);
}

integrator::RenderOptions StudyRenderer::schedule_of(const Prepared& p,
                                                     const study::RenderRequest& request) {
    integrator::RenderOptions schedule = p.job.settings.schedule;
    schedule.seed = request.seed;
    schedule.tile_size = film::Film::tile_size;
    schedule.end_sample = request.spp.back();
    return schedule;
}

Result<study::RenderRun> StudyRenderer::render_into(film::Film& film,
                                                    const Prepared& p,
                                                    const study::RenderRequest& request) {
    integrator::RenderOptions schedule = schedule_of(p, request);
    const std::unique_ptr<const integrator::PathTracer> tracer =
        p.renderer->make_tracer(request.seed);
    const GridPixels pixels =
        request.region ? GridPixels(*request.region, window_) : GridPixels(request.grid, window_);
    study::RenderRun run;
    run.setup_s = p.setup_s;
    run.outline_px = p.place->outline_px;
    run.pixel_s.assign(request.grid.pixels(), 0.0f);
    // A pixel belongs to one task at a time
    const auto sample = [&](int x, int y, uint64_t s, film::SampleRadiance& out,
                            integrator::RayCounts& counts) {
        const size_t i = size_t(y) * size_t(request.grid.width) + size_t(x);
        const auto begin = std::chrono::steady_clock::now();
        tracer->trace(pixels.x(i), pixels.y(i), s, out, counts);
        run.pixel_s[i] +=
            std::chrono::duration<float>(std::chrono::steady_clock::now() - begin).count();
    };
    std::atomic<bool> stop = false;
    integrator::RenderCallbacks callbacks;
    callbacks.stop = &stop;
    callbacks.progress = [&](const integrator::RenderState&) {
        if (StopSignals::stop_flag() || std::chrono::steady_clock::now() > request.deadline)
            stop = true;
    };

    double cpu_s = 0;
    uint64_t rays = 0;
    for (const uint64_t spp : request.spp) {
        // Where samples go is decided by pilot samples: a render that begins without them would
        // take them twice
        if (schedule.adaptive && spp <= integrator::pilot_samples &&
            spp != p.job.settings.schedule.end_sample && spp != request.spp.back())
            continue;
        schedule.end_sample = spp;
        const double start = cpu_seconds();
        const integrator::RenderResult result =
            integrator::run_schedule(film, schedule, sample, callbacks);
        cpu_s += cpu_seconds() - start;
        rays += result.rays.total();
        if (result.reason == integrator::StopReason::Interrupted)
            return Error{"stopped", "stopped"};
        run.readings.push_back(
            {spp, means_of(film.sums(), accumulate::AccumulatorTable::beauty), cpu_s, rays});
    }
    if (request.options.empty()) run.layers = layers_of_film(film);
    return run;
}

}  // namespace velatura::app
