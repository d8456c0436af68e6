// SPDX-License-Identifier: Apache-2.0
// What sampling an environment by its image is worth: irradiance of unoccluded matte receivers of
// 14 orientations under the maps in the folder hdri of the test files, efficiency = 1 / (relative
// variance × CPU seconds). Usage: velatura_bench_environment [MAP…]
#include "cpu_clock.h"
#include "lights/light_set.h"
#include "render/light_images.h"
#include "sampling/sampler.h"
#include "sampling/warp.h"
#include "test_assets.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

namespace {

using namespace velatura;
using bench::cpu_seconds;
using sampling::Purpose;
using sampling::SamplerKind;

constexpr int sample_count = 256;  ///< of one run
constexpr int run_count = 48;      ///< per orientation; their spread is the error
constexpr int mean_run_count = 24, mean_sample_count = 1 << 14;  ///< of the check of the means
constexpr int moment_sample_count = 1 << 15;
constexpr double largest_sigma = 5.0;

/// Where the directions come from.
enum class Method { Map, Mis, Cosine, Uniform };

const char* name_of(Method method) {
    switch (method) {
        case Method::Map:
            return "map";
        case Method::Mis:
            return "map + cosine by MIS";
        case Method::Cosine:
            return "cosine";
        case Method::Uniform:
            return "uniform sphere";
    }
    return "";
}

constexpr Method methods[] = {Method::Map, Method::Mis, Method::Cosine, Method::Uniform};
constexpr SamplerKind kinds[] = {SamplerKind::Sobol, SamplerKind::Independent};

/// Faces and corners of a cube.
std::vector<Vec3> orientations() {
    std::vector<Vec3> out;
    for (int axis = 0; axis < 3; ++axis) {
        for (const float sign : {1.0f, -1.0f}) {
            Vec3 n(0.0f);
            n[axis] = sign;
            out.push_back(n);
        }
    }
    for (int i = 0; i < 8; ++i)
        out.push_back(
            Vec3(i & 1 ? 1.0f : -1.0f, i & 2 ? 1.0f : -1.0f, i & 4 ? 1.0f : -1.0f).normalized());
    return out;
}

/// The dome as `velatura render` prepares it, with and without what only MIS may have.
class Environment {
  public:
    explicit Environment(const std::string& file) {
        scene::Light dome;
        dome.kind = scene::LightKind::Dome;
        dome.name = "/Dome";
        dome.texture_file = file;
        scene_.lights = {dome};
        scene_.groups.resize(2);
        const lights::ImageLoader load = render::make_light_image_loader();
        plain_ = std::make_unique<lights::LightSet>(scene_, load, diagnostics_);
        compensated_ = std::make_unique<lights::LightSet>(
            scene_, load, diagnostics_, lights::LightSetOptions{.compensate_mis = true});
    }

    bool is_on() const { return plain_->is_on(0); }

    /// One estimate of the irradiance (luminance) on a receiver that faces n.
    double estimate(Method method, const Vec3& n, const sampling::PixelSampler& sampler) const {
        const Vec2 u = sampler.get_2d(0, Purpose::LightSurface);
        switch (method) {
            case Method::Map:
                return by_map(*plain_, n, u, false);
            case Method::Mis: {
                const Vec2 v = sampler.get_2d(0, Purpose::BsdfDirection);
                return by_map(*compensated_, n, u, true) + by_cosine(*compensated_, n, v, true);
            }
            case Method::Cosine:
                return by_cosine(*plain_, n, u, false);
            case Method::Uniform: {
                const float z = 1.0f - 2.0f * u.x, r = std::sqrt(std::max(0.0f, 1.0f - z * z));
                const Vec3 d(r * std::cos(2 * pi * u.y), r * std::sin(2 * pi * u.y), z);
                const float cosine = n.dot(d);
                if (cosine <= 0.0f) return 0.0;
                return double(luminance(plain_->background(d)) * cosine) * 4.0 * pi_d;
            }
        }
        return 0.0;
    }

    /// Variance of one estimate from an independent point. The second moments are integrals over
    /// the sphere like any other and are found by sampling the map: a spread of few runs would say
    /// nothing of methods that meet the sun once in 10^5 samples.
    double variance(Method method, const Vec3& n) const {
        // Up to two samplers a and b, weighed by the balance heuristic
        double first[2] = {}, second[2] = {};
        for (int i = 0; i < moment_sample_count; ++i) {
            const sampling::PixelSampler sampler(1, 0, 0, uint64_t(i));
            const auto s = plain_->sample(0, Vec3(0.0f), sampler.get_2d(0, Purpose::LightSurface));
            const double cosine = s ? double(n.dot(s->wi)) : 0.0;
            if (cosine <= 0.0) continue;
            const double q = double(s->pdf), f = double(luminance(s->Le)) * cosine;
            double pdfs[2] = {q, 0.0};
            if (method == Method::Cosine) pdfs[0] = cosine / pi_d;
            if (method == Method::Uniform) pdfs[0] = 1.0 / (4.0 * pi_d);
            if (method == Method::Mis) {
                pdfs[0] = double(compensated_->pdf(0, Vec3(0.0f), s->wi));
                pdfs[1] = cosine / pi_d;
            }
            const double value = f / (pdfs[0] + pdfs[1]);
            for (int k = 0; k < 2; ++k) {
                first[k] += value * pdfs[k] / q / moment_sample_count;
                second[k] += value * value * pdfs[k] / q / moment_sample_count;
            }
        }
        double sum = 0;
        for (int k = 0; k < 2; ++k) sum += second[k] - first[k] * first[k];
        return sum;
    }

  private:
    static double by_map(const lights::LightSet& lights,
                         const Vec3& n,
                         const Vec2& u,
                         bool is_mis) {
        const auto s = lights.sample(0, Vec3(0.0f), u);
        if (!s) return 0.0;
        const double cosine = double(n.dot(s->wi)), pdf = double(s->pdf);
        if (cosine <= 0.0) return 0.0;
        return double(luminance(s->Le)) * cosine / (is_mis ? pdf + cosine / pi_d : pdf);
    }

    static double by_cosine(const lights::LightSet& lights,
                            const Vec3& n,
                            const Vec2& u,
                            bool is_mis) {
        const Vec2d disk = sampling::concentric_disk(Vec2d(u));
        const double z = std::sqrt(std::max(0.0, 1.0 - disk.dot(disk)));
        const Vec3 a = n.cross(std::abs(n.x) < 0.7f ? Vec3(1, 0, 0) : Vec3(0, 1, 0)).normalized();
        const Vec3 d = a * float(disk.x) + n.cross(a) * float(disk.y) + n * float(z);
        if (!is_mis) return double(luminance(lights.background(d))) * pi_d;
        const auto hit = lights.intersect(0, Vec3(0.0f), d);
        return hit && z > 0.0 ? double(luminance(hit->Le)) * z / (double(hit->pdf) + z / pi_d)
                              : 0.0;
    }

    scene::Scene scene_;
    Diagnostics diagnostics_;
    std::unique_ptr<lights::LightSet> plain_, compensated_;
};

/// Mean over samples, several times for one orientation.
struct Runs {
    double mean = 0, variance = 0;  ///< variance of one run
};

Runs run(const Environment& environment,
         Method method,
         SamplerKind kind,
         const Vec3& n,
         int orientation,
         int runs,
         int samples) {
    Runs out;
    double squares = 0;
    for (int r = 0; r < runs; ++r) {
        double sum = 0;
        for (int i = 0; i < samples; ++i) {
            const sampling::PixelSampler sampler(uint64_t(method), r, orientation, uint64_t(i),
                                                 kind);
            sum += environment.estimate(method, n, sampler);
        }
        const double mean = sum / samples;
        out.mean += mean / runs;
        squares += mean * mean;
    }
    out.variance = std::max(0.0, squares - runs * out.mean * out.mean) / (runs - 1);
    return out;
}

/// One line of the table.
struct Row {
    /// Of one run, averaged over orientations: measured for Sobol' points, from second moments for
    /// independent ones.
    double relative_variance = 0, cpu_s = 0;

    double efficiency() const { return 1.0 / (relative_variance * cpu_s); }
};

Row measure(const Environment& environment,
            Method method,
            SamplerKind kind,
            const std::vector<double>& means) {
    const std::vector<Vec3> normals = orientations();
    Row row;
    const double start = cpu_seconds();
    for (size_t i = 0; i < normals.size(); ++i) {
        const Runs runs =
            run(environment, method, kind, normals[i], int(i), run_count, sample_count);
        row.relative_variance += runs.variance / (means[i] * means[i]) / double(normals.size());
    }
    row.cpu_s = (cpu_seconds() - start) / double(normals.size()) / run_count;
    if (kind == SamplerKind::Sobol) return row;
    row.relative_variance = 0;
    for (size_t i = 0; i < normals.size(); ++i) {
        row.relative_variance += environment.variance(method, normals[i]) / sample_count /
                                 (means[i] * means[i]) / double(normals.size());
    }
    return row;
}

/// Irradiances by the map's own sampling, and whether the other methods have the same mean: in
/// standard errors of the difference, summed over the orientations.
bool check_means(const Environment& environment, std::vector<double>& means) {
    const std::vector<Vec3> normals = orientations();
    bool is_good = true;
    double sums[std::size(methods)] = {}, variances[std::size(methods)] = {};
    for (const Method method : methods) {
        const auto m = size_t(method);
        for (size_t i = 0; i < normals.size(); ++i) {
            const Runs runs = run(environment, method, SamplerKind::Sobol, normals[i], int(i) + 100,
                                  mean_run_count, mean_sample_count);
            if (method == Method::Map) means.push_back(runs.mean);
            sums[m] += runs.mean;
            variances[m] += runs.variance / mean_run_count;
        }
        const double error = std::sqrt(variances[m] + variances[0]);
        const double deviation = sums[m] - sums[0];
        if (m == 0) continue;
        fmt::print(
            "  mean by {:20} is {:+.1e} off the map's, {:.1f} standard errors; detectable "
            "{:.1e}\n",
            name_of(method), deviation / sums[0], std::abs(deviation) / error,
            5.2816 * error / sums[0]);
        is_good &= std::abs(deviation) <= largest_sigma * error;
    }
    return is_good;
}

bool report(const std::filesystem::path& file) {
    const Environment environment(file.string());
    fmt::print("\n{}\n", file.stem().string());
    if (!environment.is_on()) {
        fmt::print("  cannot be read\n");
        return false;
    }
    std::vector<double> means;
    const bool is_good = check_means(environment, means);
    for (const SamplerKind kind : kinds) {
        const Row cosine = measure(environment, Method::Cosine, kind, means);
        for (const Method method : methods) {
            const Row row =
                method == Method::Cosine ? cosine : measure(environment, method, kind, means);
            fmt::print(
                "  {:11} {:20} relative deviation {:9.3g}  {:5.0f} ns per sample  "
                "efficiency {:9.3g}  {:9.3g} x cosine\n",
                kind == SamplerKind::Sobol ? "Sobol'" : "independent", name_of(method),
                std::sqrt(row.relative_variance), 1e9 * row.cpu_s / sample_count, row.efficiency(),
                row.efficiency() / cosine.efficiency());
            std::fflush(stdout);
        }
    }
    return is_good;
}

}  // namespace

int main(int argc, char** argv) {
    const std::filesystem::path folder = test_assets() / "hdri";
    if (!std::filesystem::is_directory(folder)) {
        fmt::print("no maps at {}: nothing to measure\n", folder.string());
        return 0;
    }
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        if (entry.path().extension() != ".exr") continue;
        bool is_chosen = argc == 1;
        for (int i = 1; i < argc; ++i) is_chosen |= entry.path().stem() == argv[i];
        if (is_chosen) files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    fmt::print(
        "irradiance of {} unoccluded orientations, {} samples, {} runs, one thread; seeds "
        "are fixed\n",
        orientations().size(), sample_count, run_count);
    bool is_good = true;
    for (const std::filesystem::path& file : files) is_good &= report(file);
    if (!is_good) fmt::print("\nthe means do not agree\n");
    return is_good ? 0 : 1;
}
