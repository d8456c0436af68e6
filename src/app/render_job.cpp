// SPDX-License-Identifier: Apache-2.0
#include "app/render_job.h"

#include "app/effect_choice.h"
#include "app/parse_values.h"
#include "film/lobe_layers.h"
#include "image/formats.h"
#include "usd/stage/path_expression.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <limits>

namespace velatura::app {

namespace {

Error usage(std::string message) {
    return {"usage", std::move(message)};
}

lights::SelectionKind selection_kind(std::string_view name) {
    if (name == "uniform") return lights::SelectionKind::Uniform;
    if (name == "area") return lights::SelectionKind::Area;
    return name == "power" ? lights::SelectionKind::Power : lights::SelectionKind::Tree;
}

/// The points of a pixel. Two halves that know nothing of each other cost efficiency: only where
/// their difference counts.
sampling::SamplerKind sampler_kind(const RenderArguments& a) {
    if (a.sampler == "independent") return sampling::SamplerKind::Independent;
    if (a.sampler == "stratified")
        return a.halves ? sampling::SamplerKind::StratifiedHalves
                        : sampling::SamplerKind::Stratified;
    if (a.sampler == "blue-noise")
        return a.halves ? sampling::SamplerKind::BlueNoiseHalves : sampling::SamplerKind::BlueNoise;
    return a.halves ? sampling::SamplerKind::SobolHalves : sampling::SamplerKind::Sobol;
}

/// Who looks for lights, and how.
Result<void> choose_light_sampling(const RenderArguments& a, RenderJob& job) {
    using integrator::LightSampling;

    struct Way {
        std::string_view name;
        LightSampling sampling;
        bool by_area = false;
    };

    constexpr Way ways[] = {{"mis", LightSampling::Mis},
                            {"light", LightSampling::Light},
                            {"area", LightSampling::Light, true},
                            {"global-area", LightSampling::Light, true},
                            {"hemisphere", LightSampling::Hemisphere},
                            {"cosine", LightSampling::Cosine},
                            {"bsdf", LightSampling::Bsdf}};
    // The integrator's name stands for a way of light sampling; naming another one is a
    // contradiction but for `path`
    const std::string_view usual = a.integrator == "path"    ? "mis"
                                   : a.integrator == "naive" ? "bsdf"
                                                             : "light";
    const std::string_view wanted =
        a.light_sampling.empty() ? usual : std::string_view(a.light_sampling);
    if (wanted != usual && a.integrator != "path")
        return usage(fmt::format("--integrator {} implies --light-sampling {}, found {}",
                                 a.integrator, usual, wanted));
    const Way* const way = std::find_if(std::begin(ways), std::end(ways),
                                        [&](const Way& w) { return w.name == wanted; });
    if (way == std::end(ways))
        return usage(fmt::format("--light-sampling: unknown strategy \"{}\"", wanted));
    job.light_sampling = wanted;
    job.settings.tracer.estimator.light_sampling = way->sampling;
    job.settings.world.samples_light_area = way->by_area;

    const bool is_global = wanted == "global-area";
    if (is_global && !a.light_selection.empty() && a.light_selection != "area")
        return usage(
            fmt::format("--light-sampling global-area implies --light-selection area, found {}",
                        a.light_selection));
    job.light_selection_name = !a.light_selection.empty() ? a.light_selection
                               : is_global                ? "area"
                                                          : "tree";
    job.settings.world.light_selection = selection_kind(job.light_selection_name);
    return {};
}

/// How paths end.
Result<void> choose_roulette(const RenderArguments& a, integrator::EstimatorOptions& estimator) {
    using integrator::Roulette;

    struct Way {
        std::string_view name;
        Roulette roulette;
    };

    constexpr Way ways[] = {{"throughput", Roulette::Throughput}, {"albedo", Roulette::Albedo},
                            {"efficiency", Roulette::Efficiency}, {"constant", Roulette::Constant},
                            {"cutoff", Roulette::Cutoff},         {"none", Roulette::None}};
    const Way* const way = std::find_if(std::begin(ways), std::end(ways),
                                        [&](const Way& w) { return w.name == a.roulette; });
    if (way == std::end(ways))
        return usage(fmt::format("--roulette: unknown strategy \"{}\"", a.roulette));
    estimator.roulette = way->roulette;
    if (estimator.roulette == Roulette::None && a.max_depth == 0)
        return usage(
            "--roulette none needs --max-depth; without both, paths in closed rooms never "
            "terminate");
    if (a.cutoff && estimator.roulette != Roulette::Cutoff)
        return usage(
            fmt::format("--cutoff needs --roulette cutoff, found --roulette {}", a.roulette));
    if (a.cutoff) estimator.cutoff = float(*a.cutoff);
    return {};
}

/// The estimator that the command line names.
Result<void> choose_estimator(const RenderArguments& a, RenderJob& job) {
    integrator::EstimatorOptions& estimator = job.settings.tracer.estimator;
    if (const auto ok = choose_light_sampling(a, job); !ok) return ok.error();
    estimator.specular_chains_only = a.integrator == "whitted";
    if (const auto ok = choose_roulette(a, estimator); !ok) return ok.error();
    job.settings.tracer.sampler = sampler_kind(a);
    const std::optional<integrator::Guiding> guiding = integrator::guiding_mode(a.guiding);
    if (!guiding)
        return usage(fmt::format("--guiding: expected off, auto or on, found \"{}\"", a.guiding));
    // Chains of mirrors leave no direction to learn
    if (*guiding == integrator::Guiding::On && estimator.specular_chains_only)
        return usage(
            "--guiding on has no effect with --integrator whitted, which only follows mirrors");
    job.settings.guiding = *guiding;
    job.settings.splits = a.splitting == "auto";
    const Result<EffectChoice> effects = parse_effects(a.effects);
    if (!effects) return effects.error();
    job.settings.omitted = effects->omitted;
    job.settings.force_all = effects->force_all;
    const std::optional<integrator::Caustics> caustics = integrator::caustics_mode(a.caustics);
    if (!caustics)
        return usage(fmt::format(
            "--caustics: expected path, light, auto, manifold or small-lights, found \"{}\"",
            a.caustics));
    const bool is_asked_for =
        *caustics != integrator::Caustics::Path && *caustics != integrator::Caustics::Auto;
    if (is_asked_for && estimator.specular_chains_only)
        return usage(fmt::format(
            "--caustics {} has no effect with --integrator whitted, which omits caustics",
            a.caustics));
    job.settings.caustics = *caustics;
    for (const accel::BvhQuality quality :
         {accel::BvhQuality::Fast, accel::BvhQuality::Balanced, accel::BvhQuality::High}) {
        if (a.bvh_quality == accel::name_of(quality)) job.settings.world.bvh_quality = quality;
    }
    if (!job.settings.world.bvh_quality && a.bvh_quality != "auto")
        return usage(fmt::format(
            "--bvh-quality: expected auto, fast, balanced or high, found \"{}\"", a.bvh_quality));
    return {};
}

/// Words between commas and spaces; none is empty.
std::vector<std::string> words_of(std::string text) {
    std::replace(text.begin(), text.end(), ' ', ',');
    std::vector<std::string> words = split(text, ',');
    std::erase(words, std::string());
    return words;
}

Result<void> choose_layers(const RenderArguments& a, RenderJob& job) {
    film::LayerSet& layers = job.settings.layers;
    const Result<StoredBounces> bounces = parse_bounces(a.bounces);
    if (!bounces) return usage("--bounces: " + bounces.error().message);
    layers.last_bounce = bounces->last;
    job.settings.min_bounce_share = bounces->min_share;
    layers.halves = a.halves;
    layers.float_layers = a.float_layers;
    layers.bounce_layers = layers.group_layers = layers.matrix_layers = layers.shadow_layers =
        layers.caster_layers = layers.data_layers = false;
    if (a.clamp_direct) layers.clamp_direct = float(*a.clamp_direct);
    if (a.clamp_indirect) layers.clamp_indirect = float(*a.clamp_indirect);
    bool has_lobes = false, has_lobe_matrix = false;
    for (const std::string& family : split(a.layers, ',')) {
        if (family == "none") continue;
        bool* flag = family == "bounce"                         ? &layers.bounce_layers
                     : family == "light"                        ? &layers.group_layers
                     : family == "matrix"                       ? &layers.matrix_layers
                     : family == "shadow"                       ? &layers.shadow_layers
                     : family == "caster"                       ? &layers.caster_layers
                     : family == "lobe"                         ? &has_lobes
                     : family == accumulate::lobe_matrix_family ? &has_lobe_matrix
                     : family == "data"                         ? &layers.data_layers
                                                                : nullptr;
        if (flag) {
            *flag = true;
            continue;
        }
        Result<DataRequest> request = parse_data_request(family);
        if (!request) return usage("--layers: " + request.error().message);
        job.data.push_back(*std::move(request));
    }
    if (has_lobes) layers.path_layers = film::lobe_layers();
    if (has_lobe_matrix)
        for (accumulate::PathLayer& lobe : film::lobes_of_matrix())
            layers.path_layers.push_back(std::move(lobe));
    layers.has_strict_paths = a.strict_lpe;
    if (!a.casters.empty() && !layers.caster_layers)
        return usage("--casters needs caster in --layers");
    for (const std::string& text : a.casters) {
        std::string error;
        const auto expression = usd::stage::parse_path_expression(
            text, usd::layer::Path::absolute_root(), [](usd::layer::Path path) { return path; },
            error);
        if (error.empty()) {
            const std::string unknown = usd::stage::unknown_predicate(expression);
            if (!unknown.empty()) error = "unknown predicate " + unknown;
        }
        if (!error.empty()) return usage(fmt::format("--casters {}: {}", text, error));
    }
    // Shadows by caster are parts of the shadows
    layers.shadow_layers |= layers.caster_layers;
    layers.matte_levels = a.matte_levels.value_or(layers.matte_levels);
    if (a.cryptomatte.empty()) return {};
    for (const std::string& word : split(a.cryptomatte, ',')) {
        const auto kind =
            std::find_if(accumulate::matte_kinds.begin(), accumulate::matte_kinds.end(),
                         [&](accumulate::MatteKind k) { return matte_word(k) == word; });
        if (kind == accumulate::matte_kinds.end())
            return usage(
                fmt::format("--cryptomatte: expected object, material, asset, or several of them "
                            "with commas, found \"{}\"",
                            word));
        layers.mattes[size_t(*kind)] = true;
    }
    return {};
}

Result<void> choose_samples(const RenderArguments& a, RenderJob& job) {
    integrator::RenderOptions& schedule = job.settings.schedule;
    // A budget that is given alone decides; a request for a mix says how many samples it wants
    schedule.is_open_ended = !a.spp && a.samples.empty() && a.for_mix.empty() &&
                             (!a.time.empty() || !a.target_error.empty());
    schedule.end_sample = a.spp                     ? *a.spp
                          : !schedule.is_open_ended ? default_spp
                          : !a.time.empty()         ? max_timed_spp
                                                    : max_target_spp;
    if (a.requires_target && !a.spp && a.samples.empty() && a.target_error.empty())
        return usage("--require-target needs --target-error, --spp or --samples");
    schedule.needs_sure_target = a.requires_target;
    if (!a.samples.empty()) {
        if (!a.target_error.empty())
            return usage(
                "--samples and --target-error cannot be combined: a part has the error of its own "
                "samples alone; render all parts, and run `velatura-comp noise` on the merged "
                "file");
        const auto range = parse_sample_range(a.samples);
        if (!range) return usage("--samples: " + range.error().message);
        if (a.spp && range->second > *a.spp)
            return usage(fmt::format("--samples {} reaches beyond --spp {}", a.samples, *a.spp));
        schedule.first_sample = range->first;
        schedule.end_sample = range->second;
    }
    return {};
}

/// After samples and target error were chosen.
Result<void> choose_firefly_guard(const RenderArguments& a, RenderJob& job) {
    const Result<GuardChoice> guard = parse_guard(a.firefly_guard);
    if (!guard) return usage("--firefly-guard: " + guard.error().message);
    if (!guard->is_on) return {};
    if (a.clamp_indirect)
        return usage("--firefly-guard chooses --clamp-indirect; remove one of them");
    // Parts of one render need one limit
    if (!a.samples.empty() && !a.spp && !guard->samples)
        return usage(
            "--firefly-guard auto with --samples needs the samples per pixel of the whole render: "
            "--spp N, or --firefly-guard N");
    const integrator::RenderOptions& schedule = job.settings.schedule;
    integrator::FireflyGuard chosen;
    if (guard->samples)
        chosen.samples = double(*guard->samples);
    else if (a.spp || !schedule.is_open_ended)
        chosen.samples = double(a.spp ? *a.spp : schedule.end_sample);
    else if (schedule.target_error > 0)
        chosen.target_error = schedule.target_error;
    else
        chosen.samples = default_spp;
    job.settings.firefly_guard = chosen;
    job.settings.layers.clamp_indirect = std::numeric_limits<float>::max();
    return {};
}

Result<void> choose_display(const RenderArguments& a, RenderJob& job) {
    if (!a.display_layers.empty() && a.display.empty())
        return usage("--display-layers needs --display");
    if (a.display.empty()) return {};
    const Result<display::Address> address = display::parse_address(a.display);
    if (!address) return usage("--display: " + address.error().message);
    job.display = *address;
    job.display_layers = words_of(a.display_layers);
    return {};
}

/// After the style of progress.
Result<void> choose_preview(const RenderArguments& a, RenderJob& job) {
    if (!a.preview.empty() && !image::display_format(a.preview))
        return usage(fmt::format(
            "--preview: expected a name ending in .png, .jpg or .tif, found \"{}\"", a.preview));
    const bool is_in_terminal = job.progress == ProgressStyle::Image;
    // Where the output is no terminal, --progress image is plain
    const bool shows_image =
        a.progress == "image" || a.progress == "kitty" || a.progress == "sixel";
    if (!a.every.empty() && a.preview.empty() && !shows_image && !a.quiet)
        return usage("--every needs --preview or --progress image");
    if (!a.every.empty()) {
        const auto interval = parse_duration(a.every);
        if (!interval) return usage("--every: " + interval.error().message);
        constexpr double shortest_s = 0.1, longest_s = 1e6;
        if (*interval < shortest_s)
            return usage(fmt::format("--every: expected 0.1s or more, found \"{}\"", a.every));
        job.preview_interval_s = std::min(*interval, longest_s);
    }
    if (!is_in_terminal) return {};
    job.terminal = a.progress == "kitty"   ? display::TerminalProtocol::Kitty
                   : a.progress == "sixel" ? display::TerminalProtocol::Sixel
                                           : terminal_protocol();
    if (!job.terminal)
        return usage(
            "--progress image: this terminal is not known to show images; name its protocol "
            "(--progress kitty, --progress sixel), or use --preview FILE.png");
    return {};
}

/// Parses an optional text option into a number; empty stays at the default.
Result<void> parse_into(double& value,
                        const std::string& text,
                        const char* option,
                        Result<double> (*parse)(std::string_view)) {
    if (text.empty()) return {};
    const Result<double> parsed = parse(text);
    if (!parsed) return usage(fmt::format("{}: {}", option, parsed.error().message));
    value = *parsed;
    return {};
}

Result<RenderJob::Replay> parse_replay(const std::string& text) {
    const std::vector<std::string> parts = split(text, ',');
    std::array<uint64_t, 3> numbers{};
    bool is_good = parts.size() == 2 || parts.size() == 3;
    for (size_t i = 0; is_good && i < parts.size(); ++i) {
        const char* end = parts[i].data() + parts[i].size();
        const auto parsed = std::from_chars(parts[i].data(), end, numbers[i]);
        is_good = parsed.ec == std::errc() && parsed.ptr == end;
    }
    if (!is_good)
        return usage(fmt::format("--replay: expected X,Y or X,Y,SAMPLE, found \"{}\"", text));
    RenderJob::Replay out{numbers[0], numbers[1], std::nullopt};
    if (parts.size() == 3) out.sample = numbers[2];
    return out;
}

Result<void> check_sizes(const RenderArguments& a) {
    if (!a.crop.empty() && !(a.crop[0] < a.crop[1] && a.crop[2] < a.crop[3]))
        return usage("--crop: expected X0 < X1 and Y0 < Y1");
    return {};
}

/// Options that would be ignored beside another one.
Result<void> check_combinations(const RenderArguments& a) {
    if (!a.output.empty() && !has_exr_extension(a.output))
        return usage(fmt::format(
            "--output: light layers are OpenEXR; expected a name ending in .exr, found \"{}\"",
            a.output));
    if (a.deep && !a.samples.empty())
        return usage(
            "--deep and --samples cannot be combined: deep images of sample ranges do not merge");
    if (a.deep && a.resume)
        return usage("--deep and --resume cannot be combined: deep images are not resumable");
    if (a.deep && a.filter == "mitchell")
        return usage(
            "--deep and --filter mitchell cannot be combined: coverage by negative weights has no "
            "depth");
    if (!a.replay.empty() && (!a.output.empty() || !a.stats.empty()))
        return usage("--replay writes no file; remove --output and --stats");
    for (const std::string& lpe : a.lpe)
        if (lpe.find('=') == 0 || lpe.find('=') == std::string::npos)
            return usage(fmt::format("--lpe: expected NAME=EXPRESSION, found \"{}\"", lpe));
    if (!a.replay.empty() && a.deep) return usage("--replay writes no file; remove --deep");
    if (a.deep_samples && !a.deep) return usage("--deep-samples needs --deep");
    if (a.matte_levels && a.cryptomatte.empty())
        return usage("--cryptomatte-levels needs --cryptomatte");
    if (!a.matte_through.empty() && a.cryptomatte.empty())
        return usage("--cryptomatte-through needs --cryptomatte");
    if (!a.replay.empty() && a.resume) return usage("--replay traces one pixel; remove --resume");
    if (!a.paths.empty() && a.replay.empty()) return usage("--paths needs --replay X,Y");
    for (const std::string& path : a.paths)
        if (!path.ends_with(".json") && !path.ends_with(".usda"))
            return usage(fmt::format(
                "--paths: expected a name ending in .json or .usda, found \"{}\"", path));
    if (!a.rates_from.empty() && a.samples.empty()) return usage("--rates-from needs --samples");
    if (!a.rates_from.empty() && a.adaptive == "off")
        return usage("--rates-from and --adaptive off cannot be combined: all rates are 1");
    if (a.requires_assets && a.assets.missing == "ignore")
        return usage("--require-assets and --missing-assets ignore cannot be combined");
    if (!a.for_mix.empty() && !a.resume) return usage("--for-mix needs --resume");
    if (!a.for_mix.empty() && !a.samples.empty())
        return usage("--for-mix has its own sample counts; remove --samples");
    return {};
}

image::Compression compression_of(const std::string& name) {
    for (const auto& [known, compression] : image::compression_table)
        if (name == known) return compression;
    return image::Compression::Zip;
}

}  // namespace

bool has_exr_extension(const std::string& path) {
    if (path.size() < 4) return false;
    std::string end = path.substr(path.size() - 4);
    std::transform(end.begin(), end.end(), end.begin(),
                   [](unsigned char c) { return char(std::tolower(c)); });
    return end == ".exr";
}

bool keeps_final_sums(const RenderJob& job) {
    const RenderArguments& a = job.arguments;
    return a.is_resumable || a.resume || !a.checkpoint.empty() || !a.samples.empty();
}

bool keeps_sums(const RenderJob& job) {
    return keeps_final_sums(job) || !job.arguments.snapshot.empty();
}

Result<RenderJob> make_render_job(const RenderArguments& a) {
    RenderJob job;
    render::Settings& settings = job.settings;
    job.arguments = a;
    if (const auto ok = check_sizes(a); !ok) return ok.error();
    if (const auto ok = check_combinations(a); !ok) return ok.error();
    if (const auto ok = choose_layers(a, job); !ok) return ok.error();
    if (const auto ok = choose_samples(a, job); !ok) return ok.error();
    if (const auto ok =
            parse_into(settings.schedule.time_budget_s, a.time, "--time", parse_duration);
        !ok)
        return ok.error();
    if (const auto ok = parse_into(settings.schedule.target_error, a.target_error, "--target-error",
                                   parse_fraction);
        !ok)
        return ok.error();
    if (const auto ok = choose_firefly_guard(a, job); !ok) return ok.error();
    if (const auto ok = choose_display(a, job); !ok) return ok.error();
    if (const auto ok =
            parse_into(settings.schedule.forecast_error, a.forecast, "--forecast", parse_fraction);
        !ok)
        return ok.error();
    if (const auto ok = parse_into(settings.schedule.snapshot_interval_s, a.snapshot, "--snapshot",
                                   parse_duration);
        !ok)
        return ok.error();
    if (a.deep)
        settings.deep = film::DeepOptions{
            .max_samples = a.deep_samples.value_or(film::DeepOptions{}.max_samples)};
    double checkpoint_s = 0;
    if (const auto ok = parse_into(checkpoint_s, a.checkpoint, "--checkpoint", parse_duration); !ok)
        return ok.error();
    if (checkpoint_s > 0 && a.exr_layout == "split")
        return usage("--checkpoint needs a single file; remove --exr-layout split");
    // An interim image has sums, as a checkpoint: of both the more frequent
    double& interval_s = settings.schedule.snapshot_interval_s;
    if (checkpoint_s > 0)
        interval_s = interval_s > 0 ? std::min(interval_s, checkpoint_s) : checkpoint_s;
    settings.schedule.mode =
        a.mode == "tile" ? integrator::RenderMode::Tile : integrator::RenderMode::Progressive;
    if (settings.schedule.mode == integrator::RenderMode::Tile &&
        (settings.schedule.time_budget_s > 0 || settings.schedule.target_error > 0 ||
         settings.schedule.forecast_error > 0 || settings.schedule.snapshot_interval_s > 0)) {
        return usage(
            "--time, --target-error, --forecast, --snapshot and --checkpoint need --mode "
            "progressive");
    }
    settings.schedule.seed = settings.tracer.seed = a.seed;
    settings.schedule.tile_size = a.tile;
    settings.schedule.adaptive = a.adaptive == "on";
    settings.world.texture_bias = float(a.texture_bias);
    settings.world.media.majorants =
        a.volume_bounds == "one" ? media::Majorants::One : media::Majorants::Bricks;
    settings.world.dicing.rate = a.dicing_rate;
    settings.world.dicing.level = a.subdivision_level;
    settings.world.dicing.max_triangles = uint64_t(a.dicing_limit * 1e6);
    settings.schedule.max_depth = settings.tracer.max_depth = a.max_depth;
    const auto filter = sampling::filter_kind(a.filter);
    if (!filter) return usage(fmt::format("--filter: unknown filter \"{}\"", a.filter));
    settings.tracer.filter = *filter;
    for (const std::string& word : words_of(a.matte_through)) {
        integrator::MatteThrough& through = settings.tracer.matte_through;
        if (word != "refraction" && word != "reflection")
            return usage(
                fmt::format("--cryptomatte-through: expected refraction, reflection, or both with "
                            "a comma, found \"{}\"",
                            word));
        (word == "refraction" ? through.refraction : through.reflection) = true;
    }
    if (const auto ok = choose_estimator(a, job); !ok) return ok.error();
    settings.world.compensate_mis =
        settings.tracer.estimator.light_sampling == integrator::LightSampling::Mis;
    settings.schedule.has_dependent_changes =
        settings.tracer.sampler == sampling::SamplerKind::Stratified;
    settings.schedule.has_independent_halves =
        sampling::has_halves(settings.tracer.sampler) ||
        settings.tracer.sampler == sampling::SamplerKind::Independent;
    job.layout = a.exr_layout == "single"  ? layers::Layout::SinglePart
                 : a.exr_layout == "split" ? layers::Layout::Split
                                           : layers::Layout::MultiPart;
    job.compression = compression_of(a.exr_compression);
    const auto progress =
        parse_progress_style(a.quiet ? "none" : a.progress, ::isatty(STDOUT_FILENO) == 1);
    if (!progress) return usage(progress.error().message);
    job.progress = *progress;
    if (const auto ok = choose_preview(a, job); !ok) return ok.error();
    if (!a.replay.empty()) {
        if (!a.display.empty()) return usage("--replay traces one pixel; remove --display");
        if (!a.preview.empty()) return usage("--replay traces one pixel; remove --preview");
        const auto replay = parse_replay(a.replay);
        if (!replay) return replay.error();
        job.replay = *replay;
        if (!replay->sample && settings.schedule.is_open_ended)
            return usage(
                "--replay X,Y traces all samples of a pixel: give their number with --spp");
    }
    return job;
}

}  // namespace velatura::app
