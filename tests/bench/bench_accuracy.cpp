// SPDX-License-Identifier: Apache-2.0
// What renders say of their error, against what many of them show: the error stated, the samples
// forecast for smaller ones, intervals of blocks of 8×8 pixels, and where --target-error stops.
#include "accumulate/pixel_means.h"
#include "parse_options.h"
#include "statistics/block_errors.h"
#include "transport/transport_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace velatura::test {

namespace {

constexpr uint64_t early = 64, late = 256, last = 512;  // samples per pixel
constexpr std::array<uint64_t, 4> counts = {64, 128, 256, 512};

struct Options {
    std::vector<std::string> scenes = transport_scenes();
    std::vector<int> size = {160, 120};
    uint64_t seeds = 8, target_seeds = 4;
};

Pixels pixels_of(const film::Film& film) {
    const std::vector<float> rgba = accumulate::resolve_rgba(film.sums());
    Pixels pixels;
    for (size_t i = 0; i < rgba.size(); i += 4)
        pixels.insert(pixels.end(), {double(rgba[i]), double(rgba[i + 1]), double(rgba[i + 2])});
    return pixels;
}

/// One render on its way: images and blocks by samples per pixel, and what was known of the error
/// at the early one.
struct Way {
    std::map<uint64_t, Pixels> images;
    std::map<uint64_t, std::vector<statistics::BlockError>> blocks;
    statistics::ErrorCurve curve;
    std::map<uint64_t, double> error;  ///< √relMSE of this very image, against all other renders

    void see(const film::Film& film, const statistics::ErrorCurve& known, uint64_t samples) {
        images[samples] = pixels_of(film);
        if (samples == early) curve = known;
        if (samples == early || samples == late)
            blocks[samples] = statistics::block_errors(film.sums(), known.slope().value).value();
    }
};

Way render(TransportRenderer& renderer, uint64_t seed) {
    Way way;
    uint64_t pass = 0;
    TransportRenderer::Placement placement;
    // Passes end at 1, 2, 4, …
    placement.after_pass = [&](const film::Film& film, const statistics::ErrorCurve& known) {
        const uint64_t samples = uint64_t(1) << pass++;
        if (std::find(counts.begin(), counts.end(), samples) != counts.end())
            way.see(film, known, samples);
    };
    const film::Film film = renderer.render_film(seed, last, placement, renderer.beauty_layers());
    way.see(film, renderer.curve(), last);
    return way;
}

/// What the renders show.
struct Truth {
    Pixels mean;      ///< of the last images
    Pixels variance;  ///< of one of these
    double renders;

    explicit Truth(const std::vector<Way>& ways)
        : mean(ways[0].images.at(last).size()),
          variance(mean.size()),
          renders(double(ways.size())) {
        for (const Way& w : ways)
            for (size_t i = 0; i < mean.size(); ++i) mean[i] += w.images.at(last)[i] / renders;
        for (const Way& w : ways)
            for (size_t i = 0; i < mean.size(); ++i)
                variance[i] += (w.images.at(last)[i] - mean[i]) * (w.images.at(last)[i] - mean[i]) /
                               (renders - 1);
    }

    /// √relMSE of an image by the seed of one of the renders, against the mean of the others,
    /// whose noise is taken off.
    double error(const Pixels& image, const Way& own) const {
        double sum = 0;
        for (size_t i = 0; i < mean.size(); ++i) {
            const double others = (mean[i] * renders - own.images.at(last)[i]) / (renders - 1),
                         noise = variance[i] / (renders - 1);
            sum += ((image[i] - others) * (image[i] - others) - noise) /
                   (std::max(0.0, others * others - noise) + 0.01);
        }
        return std::sqrt(std::max(0.0, sum) / double(mean.size()));
    }
};

struct Spread {
    double mean = 0, deviation = 0;

    explicit Spread(const std::vector<double>& values) {
        const auto n = double(values.size());
        for (const double v : values) mean += v / n;
        for (const double v : values) deviation += (v - mean) * (v - mean) / std::max(1.0, n - 1);
        deviation = std::sqrt(deviation);
    }
};

double mean_error(const std::vector<Way>& ways, uint64_t samples) {
    double sum = 0;
    for (const Way& w : ways) sum += w.error.at(samples) / double(ways.size());
    return sum;
}

void print_stated(const std::vector<Way>& ways) {
    std::vector<double> ratios, slopes, found;
    int inside = 0;
    for (const Way& w : ways) {
        const statistics::RelativeError e = w.curve.error_at(double(early));
        const double own = w.error.at(early);
        ratios.push_back(e.value / own);
        slopes.push_back(w.curve.slope().value);
        found.push_back(std::log2(own / w.error.at(last)) / 3);
        inside += e.low <= own && own <= e.high;
    }
    const Spread ratio(ratios), slope(slopes);
    fmt::print(
        "  error at {} spp {:.2f} %; stated {:.3f} of it (+- {:.3f} from render to render), "
        "interval holds it {} of {}; slope {:.3f}, stated {:.3f}\n",
        early, 100 * mean_error(ways, early), ratio.mean, ratio.deviation, inside, ways.size(),
        Spread(found).mean, slope.mean);
}

void print_forecasts(const std::vector<Way>& ways) {
    for (const uint64_t n : {uint64_t(128), uint64_t(256), uint64_t(512)}) {
        std::vector<double> logarithms;
        int near = 0, inside = 0;
        for (const Way& w : ways) {
            const statistics::ErrorForecast f = w.curve.forecast(w.error.at(n));
            using Kind = statistics::ErrorForecast::Kind;
            if (f.kind == Kind::Rare) continue;
            const double samples = f.kind == Kind::Reached ? double(early)
                                   : f.kind == Kind::TooFar
                                       ? statistics::ErrorCurve::farthest * double(early)
                                       : f.samples;
            logarithms.push_back(std::log(samples / double(n)));
            near += std::abs(samples / double(n) - 1) <= 0.1;
            inside +=
                f.kind == Kind::Known && f.samples_low <= double(n) && double(n) <= f.samples_high;
        }
        if (logarithms.empty()) {
            fmt::print("  no forecast of {:.2f} %: the error does not fall\n",
                       100 * mean_error(ways, n));
            continue;
        }
        const Spread s(logarithms);
        fmt::print(
            "  forecast of {:.2f} %: {:.3f} times the {} spp it took (+- {:.3f}), {} of {} within "
            "10 %, interval holds it {} of {}\n",
            100 * mean_error(ways, n), std::exp(s.mean), n, s.deviation, near, logarithms.size(),
            inside, logarithms.size());
    }
}

/// Intervals of blocks against the mean of all other renders, whose own noise widens them.
void print_coverage(const std::vector<Way>& ways, const Truth& truth, uint64_t samples, int width) {
    const auto n = double(ways.size());
    uint64_t inside = 0, count = 0, uncertain = 0, blocks = 0;
    for (const Way& w : ways) {
        for (const statistics::BlockError& b : w.blocks.at(samples)) {
            ++blocks;
            uncertain += b.is_uncertain();
            for (size_t c = 0; c < 3; ++c) {
                if (b.error[c] == 0) continue;
                double others = 0, noise = 0;
                for (int y = b.window.y0; y < b.window.y1; ++y) {
                    for (int x = b.window.x0; x < b.window.x1; ++x) {
                        const size_t i = 3 * (size_t(y) * size_t(width) + size_t(x)) + c;
                        others += (truth.mean[i] * n - w.images.at(last)[i]) / (n - 1);
                        noise += truth.variance[i] / (n - 1);
                    }
                }
                const auto pixels = double(b.window.pixel_count());
                const double error = std::sqrt(b.error[c] * b.error[c] + noise / (pixels * pixels));
                inside += std::abs(b.mean[c] - others / pixels) <= b.quantile(c) * error;
                ++count;
            }
        }
    }
    const double share = double(inside) / double(count);
    fmt::print(
        "  blocks at {} spp: {:.1f} % of {} intervals hold the truth; {:.1f} % of blocks hang on a "
        "pixel or two\n",
        samples, 100 * share, count, 100 * double(uncertain) / double(blocks));
}

/// Renders that stop by themselves, between two powers of two.
void print_targets(TransportRenderer& renderer,
                   const std::vector<Way>& ways,
                   const Truth& truth,
                   uint64_t seeds) {
    for (const double part : {0.85, 0.6}) {
        const double target = part * mean_error(ways, early);
        std::vector<double> ratios, samples;
        for (uint64_t seed = 0; seed < std::min<uint64_t>(seeds, ways.size()); ++seed) {
            TransportRenderer::Placement placement;
            placement.target_error = target;
            const film::Film film =
                renderer.render_film(seed, 4096, placement, renderer.beauty_layers());
            ratios.push_back(truth.error(pixels_of(film), ways[seed]) / target);
            samples.push_back(film.noise().samples_mean);
        }
        const Spread ratio(ratios), spp(samples);
        fmt::print("  target {:.2f} %: reached {:.3f} of it (+- {:.3f}), at {:.0f} spp\n",
                   100 * target, ratio.mean, ratio.deviation, spp.mean);
    }
}

void measure(const std::string& name, const Options& options) {
    const scene::Scene scene = load_scene(name, options.size[0], options.size[1]);
    TransportRenderer renderer(scene, default_technique());
    std::vector<Way> ways;
    for (uint64_t seed = 0; seed < options.seeds; ++seed) ways.push_back(render(renderer, seed));
    const Truth truth(ways);
    for (Way& w : ways)
        for (const uint64_t n : counts) w.error[n] = truth.error(w.images.at(n), w);
    fmt::print("{}, {} x {} pixels, {} renders\n", name, options.size[0], options.size[1],
               options.seeds);
    const bool is_told = std::ranges::all_of(ways, [](const Way& w) {
        return std::ranges::all_of(w.error, [](const auto& known) { return known.second > 0; });
    });
    if (is_told) {
        print_stated(ways);
        print_forecasts(ways);
        print_targets(renderer, ways, truth, options.target_seeds);
    } else {
        fmt::print(
            "  a sample that only one of the renders met outweighs their error: more --seeds\n");
    }
    print_coverage(ways, truth, early, options.size[0]);
    print_coverage(ways, truth, late, options.size[0]);
    std::fflush(stdout);
}

}  // namespace

}  // namespace velatura::test

int main(int argc, char** argv) {
    velatura::test::Options options;
    velatura::CommandLine app("What renders say of their error, against what many of them show");
    app.add_option("scenes", options.scenes, "scenes below scenes/, without .usda");
    app.add_option("--size", options.size, "pixels").expected(2);
    app.add_option("--seeds", options.seeds, "renders of each scene").range(3, 1000);
    app.add_option("--target-seeds", options.target_seeds, "renders that stop at a target");
    if (const auto code = velatura::bench::parse_options(app, argc, argv)) return *code;
    for (const std::string& scene : options.scenes) velatura::test::measure(scene, options);
    return 0;
}
