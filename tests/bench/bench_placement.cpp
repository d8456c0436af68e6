// SPDX-License-Identifier: Apache-2.0
// What placing samples by noise is worth: efficiency = 1 / (relMSE × CPU seconds) of `--adaptive
// on` over `--adaptive off`, by renders in turns with the defaults of `velatura render`; beside it
// what perfect knowledge of the noise would bring. Usage: velatura_bench_placement [--size N]
// [--spp N] [--rounds N] [SCENE.usda…]; without scenes those of scenes/.
#include "app/exit_codes.h"
#include "app/prepare_frame.h"
#include "app/study_renderer.h"
#include "integrator/sample_placement.h"
#include "parse_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <numeric>
#include <random>
#include <string>
#include <vector>

namespace {

using namespace velatura;

struct Setup {
    int size = 96;
    uint64_t spp = 64;  ///< and four times as many
    int rounds = 12;
};

/// Renders of one setting by independent seeds.
struct Runs {
    std::vector<study::RenderRun> runs;

    const study::Reading& reading(size_t round, size_t at) const {
        return runs[round].readings[at];
    }
};

std::vector<double> mean_image(const std::vector<const Runs*>& all, size_t at) {
    std::vector<double> mean(all.front()->reading(0, at).means.size(), 0.0);
    for (const Runs* runs : all) {
        for (size_t r = 0; r < runs->runs.size(); ++r) {
            const std::vector<float>& means = runs->reading(r, at).means;
            for (size_t i = 0; i < mean.size(); ++i)
                mean[i] += double(means[i]) / double(runs->runs.size() * all.size());
        }
    }
    return mean;
}

/// relMSE of each round, by its distance from the mean of all; `norm` is what squares are divided
/// by.
std::vector<double> errors_of(const Runs& runs, size_t at, const std::vector<double>& norm) {
    const std::vector<double> mean = mean_image({&runs}, at);
    const double rounds = double(runs.runs.size());
    std::vector<double> errors;
    for (size_t r = 0; r < runs.runs.size(); ++r) {
        const std::vector<float>& means = runs.reading(r, at).means;
        double sum = 0;
        for (size_t i = 0; i < mean.size(); ++i)
            sum += (double(means[i]) - mean[i]) * (double(means[i]) - mean[i]) / norm[i];
        errors.push_back(sum / double(mean.size()) * rounds / (rounds - 1));
    }
    return errors;
}

struct Interval {
    double value = 0, low = 0, high = 0;
};

/// A statistic of rounds, with 95 % by the bootstrap: rounds are drawn with what belongs to them.
template <class Statistic>
Interval bootstrap(int rounds, const Statistic& statistic) {
    std::vector<size_t> drawn(static_cast<size_t>(rounds));
    for (size_t r = 0; r < drawn.size(); ++r) drawn[r] = r;
    Interval interval{statistic(drawn), 0, 0};
    std::mt19937_64 random(1);
    std::vector<double> values;
    for (int i = 0; i < 2000; ++i) {
        for (size_t& r : drawn) r = random() % uint64_t(rounds);
        values.push_back(statistic(drawn));
    }
    std::sort(values.begin(), values.end());
    interval.low = values[49];
    interval.high = values[1949];
    return interval;
}

double total(const std::vector<double>& values, const std::vector<size_t>& rounds) {
    double sum = 0;
    for (const size_t r : rounds) sum += values[r];
    return sum;
}

double mean_of(const std::vector<double>& values) {
    return std::accumulate(values.begin(), values.end(), 0.0) / double(values.size());
}

/// Efficiency that rates bring, by the squared error v and the cost c of a sample of each pixel.
template <class Rate>
double efficiency_by(const std::vector<double>& v, const std::vector<double>& c, const Rate& rate) {
    double error = 0, cost = 0, error_before = 0, cost_before = 0;
    for (size_t i = 0; i < v.size(); ++i) {
        error_before += v[i];
        cost_before += c[i];
        error += v[i] / rate(i);
        cost += c[i] * rate(i);
    }
    return error_before * cost_before / (error * cost);
}

/// What rates could bring at the samples of the first reading, from all rounds without them.
struct Optimum {
    double by_neighbors = 0;  ///< as rates are, with all rounds in place of the pilot: no pixel's
                              ///< own noise in its rate
    double max = 0;  ///< each pixel by its own noise and cost; too high where few rounds saw it
};

Optimum optimum_of(
    const Runs& off, const std::vector<double>& norm, int width, int height, uint64_t spp) {
    const std::vector<double> mean = mean_image({&off}, 0);
    const size_t rounds = off.runs.size();
    std::vector<double> v(norm.size() / 3, 0.0), c;
    std::vector<float> merits;
    for (size_t i = 0; i < v.size(); ++i) {
        std::vector<float> seconds;
        for (const study::RenderRun& run : off.runs) seconds.push_back(run.pixel_s[i]);
        std::nth_element(seconds.begin(), seconds.begin() + int(rounds / 2), seconds.end());
        c.push_back(double(seconds[rounds / 2]));
        for (size_t k = 3 * i; k < 3 * i + 3; ++k) {
            for (size_t r = 0; r < rounds; ++r)
                v[i] += (double(off.reading(r, 0).means[k]) - mean[k]) *
                        (double(off.reading(r, 0).means[k]) - mean[k]) / norm[k] /
                        double(rounds - 1);
        }
        merits.push_back(float(std::sqrt(v[i] / c[i])));
    }
    const integrator::SampleRates rates({0, 0, width, height},
                                        integrator::mean_around(merits, width, height));
    Optimum optimum;
    optimum.by_neighbors = efficiency_by(v, c, [&](size_t i) {
        return double(rates.count(int(i) % width, int(i) / width, spp)) / double(spp);
    });
    optimum.max = efficiency_by(v, c, [&](size_t i) { return std::max(double(merits[i]), 1e-12); });
    return optimum;
}

int measure(const std::string& name,
            const Setup& setup,
            const app::RenderJob& job,
            const app::FrameInput& input,
            Diagnostics& diagnostics) {
    app::StudyRenderer renderer(job, input, diagnostics);
    const study::Grid whole{renderer.window().width(), renderer.window().height()};
    const auto render = [&](const char* options, uint64_t seed, Runs& runs) {
        Result<study::RenderRun> run = renderer.render(
            {.options = options, .seed = seed, .grid = whole, .spp = {setup.spp, 4 * setup.spp}});
        if (!run)
            fmt::print(stderr, "error: {} [{}]\n", run.error().message, run.error().code);
        else
            runs.runs.push_back(std::move(*run));
        return run.has_value();
    };
    Runs on, off;
    for (int r = 0; r < setup.rounds; ++r) {
        const uint64_t seed = uint64_t(r) + 1;
        const bool is_on_first = r % 2 == 0;
        if (!render(is_on_first ? "" : "--adaptive off", seed, is_on_first ? on : off))
            return app::RenderError;
        if (!render(is_on_first ? "--adaptive off" : "", seed, is_on_first ? off : on))
            return app::RenderError;
    }

    std::array<std::vector<double>, 2> on_errors, off_errors;
    fmt::print("\n{}: {} x {} pixels, {} rounds\n", name, whole.width, whole.height, setup.rounds);
    for (size_t at = 0; at < 2; ++at) {
        std::vector<double> norm = mean_image({&on, &off}, at);
        for (double& m : norm) m = m * m + 0.01;
        on_errors[at] = errors_of(on, at, norm);
        off_errors[at] = errors_of(off, at, norm);
        std::vector<double> on_s, off_s;
        for (int r = 0; r < setup.rounds; ++r) {
            on_s.push_back(on.reading(size_t(r), at).cpu_s);
            off_s.push_back(off.reading(size_t(r), at).cpu_s);
        }
        const auto error_ratio = [&](const std::vector<size_t>& rounds) {
            return total(off_errors[at], rounds) / total(on_errors[at], rounds);
        };
        const auto time_ratio = [&](const std::vector<size_t>& rounds) {
            return total(off_s, rounds) / total(on_s, rounds);
        };
        const Interval gain = bootstrap(setup.rounds, [&](const std::vector<size_t>& rounds) {
            return error_ratio(rounds) * time_ratio(rounds);
        });
        const Interval error = bootstrap(setup.rounds, error_ratio),
                       time = bootstrap(setup.rounds, time_ratio);
        fmt::print(
            "  {:4} spp: {:5.2f} x as efficient [{:.2f}, {:.2f}]; relMSE {:.3g} in place of "
            "{:.3g}, x {:.2f}, time x {:.2f}\n",
            on.reading(0, at).spp, gain.value, gain.low, gain.high, mean_of(on_errors[at]),
            mean_of(off_errors[at]), 1 / error.value, 1 / time.value);
        if (at > 0) continue;
        const Optimum optimum = optimum_of(off, norm, whole.width, whole.height, setup.spp);
        fmt::print(
            "            with the noise known beforehand {:.2f}, each pixel for itself {:.2f} at "
            "most\n",
            optimum.by_neighbors, optimum.max);
    }
    // Of the root of the error against samples, from the first reading to the second
    const auto slope = [&](const std::array<std::vector<double>, 2>& errors) {
        return bootstrap(setup.rounds, [&](const std::vector<size_t>& rounds) {
            return 0.5 * std::log(total(errors[1], rounds) / total(errors[0], rounds)) /
                   std::log(4.0);
        });
    };
    const Interval with = slope(on_errors), without = slope(off_errors);
    fmt::print("  slope {:.2f} [{:.2f}, {:.2f}], without {:.2f} [{:.2f}, {:.2f}]\n", with.value,
               with.low, with.high, without.value, without.low, without.high);
    std::fflush(stdout);
    return app::Done;
}

}  // namespace

int main(int argc, char** argv) {
    CommandLine parser("What placing samples by noise is worth");
    Setup setup;
    std::vector<std::string> scenes;
    parser.add_option("--size", setup.size, "pixels across").range(16, 512);
    parser.add_option("--spp", setup.spp, "samples per pixel; also measured: four times as many")
        .range(32, 4096);
    parser.add_option("--rounds", setup.rounds, "renders of each kind").range(4, 200);
    parser.add_option("scenes", scenes, "USD files");
    if (const auto code = bench::parse_options(parser, argc, argv)) return *code;
    if (scenes.empty()) {
        for (const char* name :
             {"atelier/atelier", "bonfire/bonfire", "sky/sky", "tuft/tuft", "cornell/cornell",
              "transport/sun", "transport/lens", "transport/window", "transport/glass"}) {
            const std::string path = fmt::format("{}/scenes/{}.usda", VELATURA_SOURCE_DIR, name);
            if (std::filesystem::exists(path)) scenes.push_back(path);
        }
    }
    for (const std::string& path : scenes) {
        app::RenderArguments arguments;
        arguments.scene = path;
        arguments.resolution = {setup.size, setup.size};
        arguments.layers = "light";
        arguments.threads = 1;
        arguments.quiet = true;
        const int code = app::for_each_frame(
            arguments,
            [&](const app::RenderJob& job, const app::FrameInput& input, Diagnostics& diagnostics) {
                return measure(std::filesystem::path(path).stem().string(), setup, job, input,
                               diagnostics);
            });
        if (code != app::Done) return code;
    }
    return 0;
}
