// SPDX-License-Identifier: Apache-2.0
#include "film/film.h"

#include "accumulate/pixel_means.h"
#include "base/hash.h"
#include "base/tasks.h"
#include "film/film_scene.h"
#include "hard_case.h"
#include "image/digest.h"
#include "layers/resolve.h"

#include <gtest/gtest.h>

#include <cmath>

namespace velatura::film {
namespace {

const Window window{2, 1, 35, 20};

LayerSet full_set() {
    LayerSet set = test_layer_set();
    set.matrix_layers = set.shadow_layers = set.halves = true;
    return set;
}

std::string digest(const Film& film) {
    return image::digest_of(layers::resolve_layers(film.sums()).image);
}

TEST(Film, GivesTheSameBytesForEverySchedule) {
    Film once(window, full_set());
    render(once, 0, 24);
    const std::string expected = digest(once);

    Film passes(window, full_set());
    render(passes, 0, 1, 1);
    render(passes, 1, 2);
    render(passes, 2, 4, 1);
    render(passes, 4, 8);
    render(passes, 8, 16, 1);
    render(passes, 16, 24);
    EXPECT_EQ(digest(passes), expected);

    FilmOptions options;
    options.final_sample_end = 24;
    Film known_end(window, full_set(), options);
    render(known_end, 0, 13);
    render(known_end, 13, 24);
    EXPECT_EQ(digest(known_end), expected);

    Film other(window, full_set());
    render(other, 0, 23);
    EXPECT_NE(digest(other), expected);
}

TEST(Film, GivesTheSameBytesForEveryThreadCount) {
    std::string expected;
    for (const int threads : {1, 2, 3}) {
        const ThreadLimit limit(threads);
        Film film(window, full_set());
        const size_t columns = 3;
        parallel_for(columns * 2, [&](size_t tile) {
            SampleRadiance sample(film.layer_set());
            PixelAccumulator accumulator(film.layer_set());
            const int x0 = window.x0 + int(tile % columns) * Film::tile_size;
            const int y0 = window.y0 + int(tile / columns) * Film::tile_size;
            for (int y = y0; y < std::min(y0 + Film::tile_size, window.y1); ++y) {
                for (int x = x0; x < std::min(x0 + Film::tile_size, window.x1); ++x) {
                    film.begin_pixel(accumulator, x, y, 0);
                    for (uint64_t i = 0; i < 12; ++i) {
                        fill_sample(sample, x, y, i);
                        accumulator.add(sample);
                    }
                    film.end_pixel(accumulator);
                }
            }
        });
        if (expected.empty()) expected = digest(film);
        EXPECT_EQ(digest(film), expected) << threads;
    }
}

TEST(Film, BeautyDoesNotDependOnWhichLayersAreKept) {
    LayerSet bounces = test_layer_set(), nothing = test_layer_set();
    nothing.bounce_layers = nothing.group_layers = nothing.data_layers = false;
    Film a(window, full_set()), b(window, bounces), c(window, nothing);
    for (Film* film : {&a, &b, &c}) render(*film, 0, 9);
    EXPECT_EQ(accumulate::resolve_rgba(a.sums()), accumulate::resolve_rgba(b.sums()));
    EXPECT_EQ(accumulate::resolve_rgba(a.sums()), accumulate::resolve_rgba(c.sums()));
}

TEST(Film, AveragesByTheFilterWeightsInClosedForm) {
    LayerSet set = test_layer_set();
    Film film({0, 0, 1, 1}, set);
    SampleRadiance s(set);
    PixelAccumulator acc(set);
    film.begin_pixel(acc, 0, 0, 0);
    const float weights[] = {1.0f, 3.0f, -0.5f, 0.5f};
    for (int i = 0; i < 4; ++i) {
        s.clear();
        s.weight = weights[i];
        s.alpha = i == 1 ? 1.0f : 0.0f;
        s.add(1, 0, Rgb(float(i), 1.0f, 8.0f));
        acc.add(s);
    }
    film.end_pixel(acc);
    // (0·1 + 1·3 − 2·0.5 + 3·0.5) / 4
    const auto rgba = accumulate::resolve_rgba(film.sums());
    EXPECT_EQ(rgba[0], 0.875f);
    EXPECT_EQ(rgba[1], 1.0f);
    EXPECT_EQ(rgba[2], 8.0f);
    EXPECT_EQ(rgba[3], 0.75f);
}

TEST(H49NegativeLobes, FallBackToTheCountWhereWeightsCancel) {
    LayerSet set = test_layer_set();
    Film film({0, 0, 1, 1}, set);
    SampleRadiance s(set);
    PixelAccumulator acc(set);
    film.begin_pixel(acc, 0, 0, 0);
    for (int i = 0; i < 4; ++i) {
        s.clear();
        s.weight = i % 2 ? -1.0f : 1.0625f;
        s.add(1, 0, Rgb(i % 2 ? 0.0f : 1.0f));
        acc.add(s);
    }
    film.end_pixel(acc);
    // Σw = 0.125 < 0.1·4: divide by 4
    hardcase::expect_within({"mean where the weights cancel",
                             std::abs(double(accumulate::resolve_rgba(film.sums())[0]) - 2.125 / 4),
                             0, 0, "closed form"});
}

TEST(H39BadSamples, AreLeftOutAndNamed) {
    const auto mean_without_bad = [](bool with_bad, BadSampleReason& reason) {
        LayerSet set = test_layer_set();
        Film film({0, 0, 1, 1}, set);
        SampleRadiance s(set);
        PixelAccumulator acc(set);
        film.begin_pixel(acc, 0, 0, 10);
        for (int i = 0; i < 8; ++i) {
            s.clear();
            s.add(1, 0, Rgb(2.0f));
            if (with_bad && i == 3) s.add(2, 1, Rgb(1.0f, -1.0f, 0.0f));
            if (s.is_bad()) reason = s.bad_reason();
            acc.add(s);
        }
        film.end_pixel(acc);
        EXPECT_EQ(film.invalid_count(), with_bad ? 1u : 0u);
        if (with_bad) {
            EXPECT_EQ(film.bad_samples().size(), 1u);
            EXPECT_EQ(film.bad_samples()[0].sample, 13u);
            EXPECT_EQ(film.bad_samples()[0].reason, "negative");
        }
        return accumulate::resolve_rgba(film.sums())[0];
    };
    BadSampleReason reason = BadSampleReason::None;
    EXPECT_EQ(mean_without_bad(false, reason), 2.0f);
    EXPECT_EQ(reason, BadSampleReason::None);
    EXPECT_EQ(mean_without_bad(true, reason), 2.0f);
    EXPECT_EQ(reason, BadSampleReason::Negative);
}

TEST(H39BadSamples, AreLoggedTheSameForEverySchedule) {
    const auto log_of = [](int order) {
        LayerSet set = test_layer_set();
        Film film(window, set);
        SampleRadiance s(set);
        PixelAccumulator acc(set);
        for (int k = 0; k < int(window.pixel_count()); ++k) {
            const int i = order ? int(window.pixel_count()) - 1 - k : k;
            film.begin_pixel(acc, window.x0 + i % window.width(), window.y0 + i / window.width(),
                             0);
            s.clear();
            s.mark_bad(BadSampleReason::Other);
            acc.add(s);
            film.end_pixel(acc);
        }
        std::string text;
        for (const BadSample& b : film.bad_samples())
            text += std::to_string(b.x) + "," + std::to_string(b.y) + " ";
        EXPECT_EQ(film.bad_samples().size(), 16u);
        return text;
    };
    EXPECT_EQ(log_of(0), log_of(1));
}

TEST(Film, PredictsItsOwnErrorWithinTheInterval) {
    // Independent samples with values 0 or 2, each half of the time: variance 1, so relMSE = (1/n)
    // / (1 + 0.01)
    LayerSet set = test_layer_set();
    constexpr int n = 64;
    int inside = 0;
    constexpr int trials = 20;
    for (int trial = 0; trial < trials; ++trial) {
        Film film({0, 0, 64, 64}, set);
        SampleRadiance s(set);
        PixelAccumulator acc(set);
        for (int y = 0; y < 64; ++y) {
            for (int x = 0; x < 64; ++x) {
                film.begin_pixel(acc, x, y, 0);
                for (uint64_t i = 0; i < n; ++i) {
                    s.clear();
                    const uint64_t key =
                        hash_combine(hash_combine(uint64_t(trial), uint64_t(y * 64 + x)), i);
                    s.add(1, 0,
                          Rgb(key & 1 ? 2.0f : 0.0f, key & 2 ? 2.0f : 0.0f, key & 4 ? 2.0f : 0.0f));
                    acc.add(s);
                }
                film.end_pixel(acc);
            }
        }
        const NoiseEstimate noise = film.noise();
        EXPECT_TRUE(noise.is_known);
        EXPECT_EQ(noise.samples_min, uint64_t(n));
        // Relative to the true mean, 1
        const double expected = std::sqrt(1.0 / n / 1.01);
        EXPECT_NEAR(noise.error.value, expected, 0.05 * expected);
        inside += noise.error.low <= expected && expected <= noise.error.high;
    }
    std::printf("inside the 95%% interval: %d of %d\n", inside, trials);
    // P(17 or fewer of 20 at 0.95) = 0.075; 15 or fewer 0.0026
    EXPECT_GE(inside, 16);
}

TEST(Film, HalfImagesAreTheEvenAndTheOddSamples) {
    LayerSet set = test_layer_set();
    set.halves = true;
    Film film({0, 0, 1, 1}, set);
    SampleRadiance s(set);
    PixelAccumulator acc(set);
    film.begin_pixel(acc, 0, 0, 4);
    for (uint64_t i = 4; i < 8; ++i) {
        s.clear();
        s.add(2, 1, Rgb(i % 2 ? 3.0f : 1.0f));
        acc.add(s);
    }
    film.end_pixel(acc);
    const auto layers = layers::resolve_layers(film.sums());
    EXPECT_EQ(layers.image.find("b2_hA.R")->value(0), 1.0f);
    EXPECT_EQ(layers.image.find("b2_hB.R")->value(0), 3.0f);
    EXPECT_EQ(layers.image.find("C_fill_hB.G")->value(0), 3.0f);
    EXPECT_EQ(layers.image.find("beauty_hA.R")->value(0), 1.0f);
    // ((3 − 1) / 2)² = 1
    EXPECT_EQ(layers.image.find("variance")->value(0), 1.0f);
}

TEST(Film, DataLayersFollowTheirRules) {
    LayerSet set = test_layer_set();
    Film film({0, 0, 1, 1}, set);
    SampleRadiance s(set);
    PixelAccumulator acc(set);
    film.begin_pixel(acc, 0, 0, 0);
    acc.add(s);  // a miss
    for (int i = 0; i < 3; ++i) {
        s.clear();
        s.has_hit = true;
        s.albedo = Rgb(1.0f, 0.5f, 0.0f);
        s.N = Vec3(0, 1, 0);
        s.Z = float(i + 1);
        s.P = Vec3(float(i), 0, 6);
        s.st = Vec2(0.5f, float(i));
        s.prim_id = uint32_t(40 + i);
        s.instance_id = uint32_t(i);
        acc.add(s);
    }
    film.end_pixel(acc);
    const auto layers = layers::resolve_layers(film.sums());
    const auto value = [&](const char* name) { return layers.image.find(name)->value(0); };
    EXPECT_EQ(value("albedo.R"), 0.75f);  // blends with the miss
    EXPECT_EQ(value("N.Y"), 0.75f);
    EXPECT_EQ(value("Z"), 2.0f);  // mean of what was hit
    EXPECT_EQ(value("P.Z"), 6.0f);
    EXPECT_EQ(value("st.V"), 1.0f);
    EXPECT_EQ(value("primId"), 40.0f);  // first hit wins
    EXPECT_EQ(value("sampleCount"), 4.0f);
    EXPECT_EQ(value("invalid"), 0.0f);
}

}  // namespace
}  // namespace velatura::film
