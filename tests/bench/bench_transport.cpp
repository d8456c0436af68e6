// SPDX-License-Identifier: Apache-2.0
// What each technique of light transport is worth: efficiency = 1 / (relMSE × CPU seconds) of the
// defaults over that of the same renderer with one technique taken away, per scene, with intervals;
// then tables of single questions. Usage: velatura_bench_transport [SCENE… | placed | light-counts
// | bias]; bias only by its name
#include "base/tasks.h"
#include "cpu_clock.h"
#include "transport/transport_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace {

using namespace velatura;
using bench::cpu_seconds;
using test::Pixels;

constexpr int size_px = 96;
constexpr int run_count =
    12;  ///< independent seeds: their spread is the error, without any reference image
constexpr uint64_t sample_count = 16;
constexpr uint64_t placed_count = 64;  ///< of adaptive renders: the first 16 of them are the pilot
constexpr double blur_px = 1.5;
constexpr double floor_squared =
    0.01;  ///< of the relative error: mean² + 0.01, as in docs/engineering/numerics.md

/// Independent renders of one technique.
struct Runs {
    std::vector<Pixels> pixels;
    double cpu_s = 0;  ///< of one run
    uint64_t bad = 0;
    integrator::RayCounts rays;
};

Runs measure(const scene::Scene& scene, const test::Technique& technique) {
    test::TransportRenderer renderer(scene, technique);
    Runs runs;
    renderer.render(99, 1);  // caches warm
    const double start = cpu_seconds();
    for (int r = 0; r < run_count; ++r)
        runs.pixels.push_back(renderer.render(uint64_t(r) + 1, sample_count));
    runs.cpu_s = (cpu_seconds() - start) / run_count;
    runs.bad = renderer.bad_samples();
    runs.rays = renderer.rays();
    return runs;
}

using Placement = test::TransportRenderer::Placement;

/// The same by the render schedule; training of guides and trials count.
Runs measure_placement(test::TransportRenderer& renderer, const Placement& placement) {
    Runs runs;
    const double start = cpu_seconds();
    for (int r = 0; r < run_count; ++r)
        runs.pixels.push_back(renderer.render_scheduled(uint64_t(r) + 1, placed_count, placement));
    runs.cpu_s = (cpu_seconds() - start) / run_count;
    return runs;
}

/// relMSE of one run, from the spread of those chosen by `use`; `norm` is mean² + floor per value.
template <class Use>
double relative_variance(const std::vector<Pixels>& runs, const Pixels& norm, Use use) {
    double total = 0;
    for (size_t i = 0; i < norm.size(); ++i) {
        double n = 0, sum = 0, squares = 0;
        for (size_t r = 0; r < runs.size(); ++r) {
            if (!use(r)) continue;
            ++n;
            sum += runs[r][i];
            squares += runs[r][i] * runs[r][i];
        }
        total += std::max(0.0, squares - sum * sum / n) / (n - 1) / norm[i];
    }
    return total / double(norm.size());
}

/// What squared errors are divided by: mean² + floor.
Pixels norm_of(Pixels mean) {
    for (double& v : mean) v = v * v + floor_squared;
    return mean;
}

/// Images after a Gaussian of `blur_px`, cut off at the edges.
std::vector<Pixels> blurred(const std::vector<Pixels>& images) {
    const int reach = 6;
    const auto pass = [reach](const Pixels& from, bool is_vertical) {
        Pixels to(from.size(), 0.0);
        for (int i = 0; i < size_px * size_px; ++i) {
            const int at = is_vertical ? i / size_px : i % size_px;
            double weights = 0;
            for (int k = std::max(-reach, -at); k <= std::min(reach, size_px - 1 - at); ++k) {
                const double w = std::exp(-k * k / (2 * blur_px * blur_px));
                const int other = i + k * (is_vertical ? size_px : 1);
                for (int c = 0; c < 3; ++c)
                    to[size_t(i * 3 + c)] += w * from[size_t(other * 3 + c)];
                weights += w;
            }
            for (int c = 0; c < 3; ++c) to[size_t(i * 3 + c)] /= weights;
        }
        return to;
    };
    std::vector<Pixels> out;
    for (const Pixels& image : images) out.push_back(pass(pass(image, false), true));
    return out;
}

/// A ratio with its 95 % interval.
struct Ratio {
    double value = 0, low = 0, high = 0;
};

/// Efficiency of `a` over that of `b`. The interval is the delete-one jackknife over seeds, in the
/// logarithm; CPU time counts as exact (repeat the command to see its noise).
Ratio efficiency_ratio(const Runs& a, const Runs& b, const Pixels& norm) {
    const auto log_ratio = [&](size_t omitted) {
        const auto use = [omitted](size_t r) { return r != omitted; };
        return std::log(relative_variance(b.pixels, norm, use) * b.cpu_s) -
               std::log(relative_variance(a.pixels, norm, use) * a.cpu_s);
    };
    const double whole = log_ratio(size_t(run_count));
    double mean = 0, squares = 0;
    for (size_t r = 0; r < size_t(run_count); ++r) {
        const double x = log_ratio(r);
        mean += x / run_count;
        squares += x * x / run_count;
    }
    const double sd = std::sqrt(std::max(0.0, squares - mean * mean) * (run_count - 1));
    return {std::exp(whole), std::exp(whole - 2.2 * sd), std::exp(whole + 2.2 * sd)};
}

void report(const std::string& name) {
    const scene::Scene scene = test::load_scene(name, size_px, size_px);
    const Runs usual = measure(scene, test::default_technique());
    const auto all = [](size_t) { return true; };
    const double error = relative_variance(usual.pixels, norm_of(test::mean_of(usual.pixels)), all);
    const double paths = double(size_px * size_px) * double(sample_count);
    fmt::print(
        "\n{}: relMSE {:.3g} at {} spp, {:.3f} CPU s, efficiency {:.3g}, {:.3f} Mpaths per CPU s, "
        "{} bad samples\n",
        name, error, sample_count, usual.cpu_s, 1.0 / (error * usual.cpu_s),
        1e-6 * paths / usual.cpu_s, usual.bad);
    for (const test::Technique& technique : test::techniques()) {
        if (technique.instead_of.empty()) continue;
        const Runs other = measure(scene, technique);
        // One norm for both, from the samples of both: a pixel that only one of them saw a lamp in
        // is bright for both
        const Pixels norm =
            norm_of(test::mean_of({test::mean_of(usual.pixels), test::mean_of(other.pixels)}));
        const Ratio ratio = efficiency_ratio(usual, other, norm);
        const double error_ratio =
            relative_variance(other.pixels, norm, all) / relative_variance(usual.pixels, norm, all);
        const std::vector<Pixels> mine = blurred(usual.pixels), theirs = blurred(other.pixels);
        const Pixels blurred_norm =
            norm_of(test::mean_of({test::mean_of(mine), test::mean_of(theirs)}));
        const double filtered_ratio = relative_variance(theirs, blurred_norm, all) /
                                      relative_variance(mine, blurred_norm, all);
        fmt::print(
            "  {:24} in place of {:22}  default is {:8.2f} x as efficient [{:.2f}, {:.2f}]  relMSE "
            "x {:.2f}, after a blur of {} px x {:.2f}, time x {:.2f}\n",
            technique.name, technique.instead_of, ratio.value, ratio.low, ratio.high, error_ratio,
            blur_px, filtered_ratio, other.cpu_s / usual.cpu_s);
        std::fflush(stdout);
    }
}

/// Samples placed by noise, paths guided and divided where trial paths ask for it, against renders
/// without the one or the other.
void report_placement(const std::string& name) {
    struct Other {
        const char* name;
        Placement placement;
    };

    static const Other others[] = {
        {"the same number of samples everywhere", {.is_adaptive = false}},
        {"paths that go on by one", {.splits = false}},
        {"no guiding", {.guiding = integrator::Guiding::Off}},
        {"guiding in any case", {.guiding = integrator::Guiding::On}},
    };
    const scene::Scene scene = test::load_scene(name, size_px, size_px);
    test::TransportRenderer renderer(scene, test::default_technique());
    renderer.render(99, 1);  // caches warm
    const Runs usual = measure_placement(renderer, {});
    const bool is_guided = renderer.was_guided();
    const double branches = renderer.mean_branches();
    const auto all = [](size_t) { return true; };
    fmt::print("\n{}: {} samples per pixel in the mean, {:.3f} CPU s, {:.1f} branches{}\n", name,
               placed_count, usual.cpu_s, branches, is_guided ? ", guided" : "");
    for (const auto& [technique, placement] : others) {
        const Runs other = measure_placement(renderer, placement);
        const Pixels norm =
            norm_of(test::mean_of({test::mean_of(usual.pixels), test::mean_of(other.pixels)}));
        const Ratio ratio = efficiency_ratio(usual, other, norm);
        fmt::print(
            "  instead: {:38} default is {:6.2f} x as efficient [{:.2f}, {:.2f}]  relMSE x {:.2f}, "
            "time x {:.2f}\n",
            technique, ratio.value, ratio.low, ratio.high,
            relative_variance(other.pixels, norm, all) / relative_variance(usual.pixels, norm, all),
            other.cpu_s / usual.cpu_s);
        std::fflush(stdout);
    }
}

/// Mean of independent images and the variance of that mean, per value.
struct Estimate {
    Pixels mean, variance;
};

Estimate estimate_of(const std::vector<Pixels>& runs) {
    Estimate e{test::mean_of(runs), Pixels(runs.front().size(), 0.0)};
    const double n = double(runs.size());
    for (size_t i = 0; i < e.mean.size(); ++i) {
        for (const Pixels& run : runs)
            e.variance[i] += (run[i] - e.mean[i]) * (run[i] - e.mean[i]) / (n * (n - 1));
    }
    return e;
}

/// The default at 16 and 256 samples per pixel against 65,536 of plain paths: by the mean of the
/// image, and by blocks of pixels, whose squared distances in standard errors must be 1 in the
/// mean.
void report_bias(const std::string& name) {
    constexpr int side = 32, block = 4;
    constexpr int reference_runs = 32, runs = 64;
    constexpr uint64_t reference_samples = 65536 / reference_runs;
    const scene::Scene scene = test::load_scene(name, side, side);
    test::TransportRenderer renderer(scene, test::default_technique());
    // Sums over blocks of pixels, and over the image: values of an image of fewer pixels
    const auto summed = [](const Pixels& image, int step) {
        const int across = side / step;
        Pixels sums(size_t(across) * size_t(across) * 3, 0.0);
        for (int i = 0; i < side * side; ++i) {
            const size_t to = size_t((i / side / step) * across + i % side / step);
            for (size_t c = 0; c < 3; ++c)
                sums[to * 3 + c] += image[size_t(i) * 3 + c] / double(step * step);
        }
        return sums;
    };
    std::vector<Pixels> reference;
    for (int r = 0; r < reference_runs; ++r)
        reference.push_back(renderer.render(uint64_t(r) + 1000, reference_samples));
    for (const uint64_t samples : {uint64_t(16), uint64_t(256)}) {
        std::vector<Pixels> images;
        for (int r = 0; r < runs; ++r)
            images.push_back(renderer.render_scheduled(uint64_t(r) + 1, samples, {}));
        double worst_z = 0, mean_squared_z = 0, bias = 0, detectable = 0;
        for (const int step : {side, block}) {
            std::vector<Pixels> a, b;
            for (const Pixels& p : reference) a.push_back(summed(p, step));
            for (const Pixels& p : images) b.push_back(summed(p, step));
            const Estimate truth = estimate_of(a), found = estimate_of(b);
            for (size_t i = 0; i < truth.mean.size(); ++i) {
                const double deviation = std::sqrt(truth.variance[i] + found.variance[i]);
                const double z = deviation > 0 ? (found.mean[i] - truth.mean[i]) / deviation : 0.0;
                if (step == side) {
                    bias += (found.mean[i] / truth.mean[i] - 1) / 3;
                    detectable = std::max(detectable, 3 * deviation / truth.mean[i]);
                } else {
                    worst_z = std::max(worst_z, std::abs(z));
                    mean_squared_z += z * z / double(truth.mean.size());
                }
            }
        }
        fmt::print(
            "  {:24} {:3} spp{}: mean differs by {:+.4f} % (detectable {:.4f} %), {} blocks: mean "
            "z2 {:.2f}, largest |z| {:.1f}\n",
            name, samples, renderer.was_guided() ? ", guided" : "        ", 100 * bias,
            100 * detectable, (side / block) * (side / block), mean_squared_z, worst_z);
        std::fflush(stdout);
    }
}

struct LightTimes {
    double prepare_s = 0, path_s = 0;
};

/// Lamps above a floor, all alike, on a grid 20 units wide.
LightTimes time_lights(size_t count, float radius) {
    scene::Scene scene = test::load_scene("transport/sun", 64, 64);
    const scene::Light first = scene.lights.front();
    scene.lights.clear();
    const auto side = size_t(std::ceil(std::sqrt(double(count))));
    for (size_t i = 0; i < count; ++i) {
        scene::Light light = first;
        light.kind = scene::LightKind::Sphere;
        light.radius = radius;
        light.Le = Rgb(float(1e5 / double(count)));
        light.is_camera_visible = false;
        light.render_from_light.setTranslation(
            Vec3d(-10.0 + 20.0 * (double(i % side) + 0.5) / double(side), 1.0,
                  -20.0 + 20.0 * (double(i / side) + 0.5) / double(side)));
        scene.lights.push_back(light);
    }
    const double start = cpu_seconds();
    test::TransportRenderer renderer(scene, test::default_technique());
    const double prepared = cpu_seconds();
    renderer.render(1, 32);
    const double rendered = cpu_seconds();
    return {prepared - start, (rendered - prepared) / (64.0 * 64.0 * 32.0)};
}

/// Time per path must grow like the logarithm of the number of lights at most. Lamps of one size
/// overlap once they are many: a ray then meets several, which is no matter of choosing among them;
/// lamps that shrink with the grid show the choice.
void report_light_counts() {
    fmt::print(
        "\nTime per path against the number of lights (sphere lights on a grid above a floor)\n");
    for (int exponent = 0; exponent <= 6; ++exponent) {
        const auto count = size_t(std::pow(10.0, exponent));
        const float spacing = 20.0f / std::ceil(std::sqrt(float(count)));
        const LightTimes apart = time_lights(count, std::min(0.02f, 0.1f * spacing)),
                         same = time_lights(count, 0.02f);
        fmt::print(
            "  {:8} lights: {:6.2f} us per path, {:7.3f} s to prepare; of one size, a ray upwards "
            "meets {:4.2f}: {:6.2f} us per path\n",
            count, 1e6 * apart.path_s, apart.prepare_s, pi * 0.02f * 0.02f / (spacing * spacing),
            1e6 * same.path_s);
        std::fflush(stdout);
    }
}

}  // namespace

int main(int argc, char** argv) {
    const ThreadLimit one_thread(1);
    // `./dev bench` passes its arguments to every program: names of scenes and of these tables are
    // meant for this one
    const std::vector<std::string> words(argv + 1, argv + argc);
    const auto is_said = [&](std::string_view word) {
        return std::find(words.begin(), words.end(), word) != words.end();
    };
    std::vector<std::string> chosen;
    for (const std::string& scene : test::transport_scenes()) {
        if (std::any_of(words.begin(), words.end(), [&](const std::string& word) {
                return scene.find(word) != std::string::npos;
            }))
            chosen.push_back(scene);
    }
    const bool is_table_said = is_said("placed") || is_said("light-counts") || is_said("bias");
    const std::vector<std::string>& scenes =
        chosen.empty() && (words.empty() || is_table_said) ? test::transport_scenes() : chosen;
    fmt::print("{0} x {0} pixels, {1} samples per pixel, {2} seeds, one thread\n", size_px,
               sample_count, run_count);
    if (!is_table_said) {
        for (const std::string& scene : scenes) report(scene);
    }
    if (words.empty() || is_said("placed")) {
        fmt::print("\nAdaptive sampling, splitting and guiding\n");
        for (const std::string& scene : scenes) report_placement(scene);
    }
    if (words.empty() || is_said("light-counts")) report_light_counts();
    if (is_said("bias")) {
        fmt::print("\nThe default against 65,536 samples per pixel\n");
        for (const std::string& scene : scenes) report_bias(scene);
    }
    return 0;
}
