// SPDX-License-Identifier: Apache-2.0
// Estimators of one integral have one mean: every technique against the defaults, scene by scene.
// This is the second independent method that finds a wrong density, a missing cosine or a strategy
// that counts twice (H33).
#include "hard_case.h"
#include "transport/transport_scene.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace velatura::test {

namespace {

constexpr int size_px = 24;    ///< images are size_px × size_px
constexpr int block_px = 8;    ///< compared in blocks of block_px × block_px
constexpr int run_count = 24;  ///< independent seeds per technique
constexpr uint64_t sample_count = 16;
constexpr uint64_t blind_factor =
    6;  ///< as many more samples without light sampling, which meets lamps seldom
constexpr double family_alpha = 0.01;  ///< of all comparisons of one scene together
/// A technique can be judged on a scene when the test sees a deviation of the whole image's mean
/// of this size.
constexpr double largest_detectable = 0.15;

/// Techniques that practically never find some lamp of a scene: their few samples say nothing about
/// their mean.
struct Hopeless {
    const char* scene;
    const char* technique;
    const char* reason;
};

constexpr Hopeless hopeless[] = {
    {"transport/sun", "BSDF sampling alone",
     "a sun of 0.53 degrees; wide_sun has the same code on a target that is met"},
    {"transport/doorway", "BSDF sampling alone", "the same sun"},
    {"transport/many_lights", "BSDF sampling alone", "lamps of 10 mm; cornell judges it"},
    {"transport/many_lights", "area of all lights",
     "few points fall on the small lamps; analytic/classic_estimators_test judges them"},
    {"transport/glowing_mesh", "area of all lights",
     "points by area near a large mesh are rare and bright; window and linked judge it"},
    {"transport/gloss", "area of all lights", "the same on narrow lobes"},
    {"transport/sheets", "lights by area",
     "a panel 10 cm from a wall: points near by are rare and bright; lens and linked judge it"},
    {"transport/sheets", "area of all lights", "the same panel"},
    {"transport/gloss", "light sampling alone",
     "highlights of a narrow lobe are rare and bright; cornell and glass judge it"},
    {"transport/glass", "caustics solved for",
     "a large panel: solutions near the focus are rare and bright; analytic/specular_chain_test "
     "judges them"},
    {"transport/sheets", "caustics solved for",
     "large panels as in glass; analytic/absorption_test judges chains that absorb"},
    {"transport/baffle", "BSDF sampling alone",
     "a small lamp out of reach of most paths; cornell judges it"},
};

const Hopeless* find_hopeless(const std::string& scene, const std::string& technique) {
    // Directions over the hemisphere find no lamp that those of the BSDF miss
    const bool is_blind = technique.find("hemisphere") == 0;
    const std::string like = is_blind ? "BSDF sampling alone" : technique;
    for (const Hopeless& h : hopeless) {
        if (scene == h.scene && like == h.technique) return &h;
    }
    return nullptr;
}

/// Upper quantile of the normal distribution: x with P(X > x) = p. Ref: Abramowitz & Stegun 26.2.23
/// (error < 4.5e-4).
double normal_quantile(double p) {
    const double t = std::sqrt(-2.0 * std::log(p));
    return t - (2.515517 + t * (0.802853 + t * 0.010328)) /
                   (1.0 + t * (1.432788 + t * (0.189269 + t * 0.001308)));
}

/// Upper quantile of Student's t with n degrees of freedom. Ref: Abramowitz & Stegun 26.7.5, three
/// terms.
double student_quantile(double p, double n) {
    const double x = normal_quantile(p);
    const double x3 = x * x * x, x5 = x3 * x * x, x7 = x5 * x * x;
    return x + (x3 + x) / (4 * n) + (5 * x5 + 16 * x3 + 3 * x) / (96 * n * n) +
           (3 * x7 + 19 * x5 + 17 * x3 - 15 * x) / (384 * n * n * n);
}

/// Mean luminance-like sum of each block, [run][block].
std::vector<std::vector<double>> block_means(const scene::Scene& scene,
                                             const Technique& technique,
                                             uint64_t first_seed) {
    TransportRenderer renderer(scene, technique);
    const uint64_t samples =
        technique.instead_of == "light sampling" ? sample_count * blind_factor : sample_count;
    constexpr int blocks = size_px / block_px;
    std::vector<std::vector<double>> out;
    for (int run = 0; run < run_count; ++run) {
        const Pixels pixels = renderer.render(first_seed + uint64_t(run), samples);
        std::vector<double> means(size_t(blocks * blocks));
        for (int y = 0; y < size_px; ++y) {
            for (int x = 0; x < size_px; ++x) {
                const double* p = &pixels[size_t(y * size_px + x) * 3];
                means[size_t(y / block_px * blocks + x / block_px)] +=
                    (p[0] + p[1] + p[2]) / (3.0 * block_px * block_px);
            }
        }
        out.push_back(means);
    }
    EXPECT_EQ(renderer.bad_samples(), 0u) << technique.name;
    return out;
}

struct Moments {
    double mean = 0, variance_of_mean = 0;
};

Moments moments(const std::vector<std::vector<double>>& runs, size_t block) {
    Moments m;
    for (const auto& r : runs) m.mean += r[block] / double(runs.size());
    for (const auto& r : runs) m.variance_of_mean += (r[block] - m.mean) * (r[block] - m.mean);
    m.variance_of_mean /= double(runs.size()) * double(runs.size() - 1);
    return m;
}

class H33Agreement : public testing::TestWithParam<std::string> {};

TEST_P(H33Agreement, EveryTechniqueHasTheMeanOfTheDefaults) {
    scene::Scene scene = load_scene(GetParam(), size_px, size_px);
    // The edges of lamps in view are the same noise for all; it would hide what differs
    for (scene::Light& light : scene.lights) light.is_camera_visible = false;
    const auto reference = block_means(scene, default_technique(), 1000);
    const size_t block_count = reference.front().size();
    const size_t comparisons = block_count * (techniques().size() - 1);
    const double alpha = 1.0 - std::pow(1.0 - family_alpha, 1.0 / double(comparisons));
    uint64_t seed = 2000;
    for (const Technique& technique : techniques()) {
        if (technique.instead_of.empty()) continue;
        if (const Hopeless* h = find_hopeless(GetParam(), technique.name)) {
            std::printf("%-24s %-22s not judged here: %s\n", GetParam().c_str(),
                        technique.name.c_str(), h->reason);
            continue;
        }
        const auto other = block_means(scene, technique, seed);
        seed += 1000;
        double worst = 0, variance = 0, mean = 0;
        for (size_t b = 0; b < block_count; ++b) {
            // Welch's t test; degrees of freedom by Welch and Satterthwaite
            const Moments x = moments(reference, b), y = moments(other, b);
            const double v = x.variance_of_mean + y.variance_of_mean;
            variance += v;
            mean += x.mean;
            if (v == 0) {
                EXPECT_EQ(x.mean, y.mean);
                continue;
            }
            const double n = double(run_count - 1);
            const double freedom = v * v /
                                   (x.variance_of_mean * x.variance_of_mean / n +
                                    y.variance_of_mean * y.variance_of_mean / n);
            const double t = std::abs(x.mean - y.mean) / std::sqrt(v);
            const double limit = student_quantile(alpha / 2, freedom);
            worst = hardcase::larger(worst, t / limit);
            EXPECT_LT(t, limit) << technique.name << ": block " << b << " has " << y.mean
                                << ", by default " << x.mean;
        }
        const double detectable =
            (student_quantile(alpha / 2, run_count - 1) + 1.2816) * std::sqrt(variance) / mean;
        std::printf(
            "%-24s %-22s worst t %4.2f of its limit; 90 %% power from %5.2f %% of the picture's "
            "mean\n",
            GetParam().c_str(), technique.name.c_str(), worst, 100 * detectable);
        EXPECT_LT(detectable, largest_detectable) << technique.name << " is too noisy to be judged";
        hardcase::expect_within(
            {fmt::format("{}: worst t of a block of the picture, over its limit", technique.name),
             worst, 1, 0, "the default technique",
             fmt::format("{:.1f} % of the picture's mean", 100 * detectable)});
    }
}

/// Those where the estimators settle soon: caustics of small lamps, by glass or by plates of metal,
/// take more samples than a test can.
std::vector<std::string> judged_scenes() {
    std::vector<std::string> scenes;
    for (const std::string& s : transport_scenes()) {
        if (s != "transport/caustic" && s != "transport/lamp_sizes") scenes.push_back(s);
    }
    return scenes;
}

std::string test_name(const testing::TestParamInfo<std::string>& info) {
    return info.param.substr(info.param.find('/') + 1);
}

INSTANTIATE_TEST_SUITE_P(Scenes, H33Agreement, testing::ValuesIn(judged_scenes()), test_name);

}  // namespace

}  // namespace velatura::test
