// SPDX-License-Identifier: Apache-2.0
#include "film/deep_film.h"
#include "film/film.h"
#include "film/film_scene.h"
#include "layers/deep_file.h"
#include "layers/layer_file.h"

#include <OpenEXR/ImfCompositeDeepScanLine.h>
#include <OpenEXR/ImfDeepScanLineInputFile.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace velatura::film {
namespace {

const Window window{-2, 3, 17, 14};

/// The samples of film_scene, whose weights a deep image can have.
void render_deep(Film& film, uint64_t first, uint64_t end, bool from_the_right = false) {
    SampleRadiance sample(film.layer_set());
    PixelAccumulator accumulator(film.layer_set());
    for (int i = 0; i < int(window.pixel_count()); ++i) {
        const int at = from_the_right ? int(window.pixel_count()) - 1 - i : i;
        const int x = window.x0 + at % window.width(), y = window.y0 + at / window.width();
        film.begin_pixel(accumulator, x, y, first);
        for (uint64_t s = first; s < end; ++s) {
            fill_sample(sample, x, y, s);
            sample.weight = std::abs(sample.weight);
            accumulator.add(sample);
        }
        film.end_pixel(accumulator);
    }
}

struct Written {
    image::Image flat;
    layers::DeepImage deep;
};

Written written(const Film& film, const std::string& name = "deep_test.exr") {
    const std::string path = temporary_file(name);
    const auto report = film.write(path, {});
    EXPECT_TRUE(report.has_value()) << report.error().message;
    const auto deep = write_deep_image(*film.deep(), path);
    EXPECT_TRUE(deep.has_value()) << deep.error().message;
    return {*layers::read_layer_file(path), *layers::read_deep_file(deep_path(path))};
}

/// Laid over each other as compositing programs do, and what roundings may come to.
struct Flattened {
    std::array<float, 4> rgba{};
    std::array<double, 4> bound{};
};

Flattened flattened(const layers::DeepSample* samples, size_t count) {
    Flattened f;
    for (size_t i = 0; i < count; ++i) {
        const layers::DeepSample& s = samples[i];
        const float left = 1.0f - f.rgba[3];
        const std::array<float, 4> add = {s.r, s.g, s.b, s.a};
        for (size_t c = 0; c < 4; ++c) {
            f.rgba[c] += left * add[c];
            f.bound[c] += std::abs(double(left * add[c]));
        }
    }
    for (double& b : f.bound) b = b * double(count + 3) * 0x1p-23 + 1e-37;
    return f;
}

/// The same by OpenEXR itself: [height][width][4].
std::vector<float> composited(const std::string& path) {
    Imf::DeepScanLineInputFile file(path.c_str());
    Imf::CompositeDeepScanLine composite;
    composite.addSource(&file);
    std::vector<float> rgba(4 * window.pixel_count());
    Imf::FrameBuffer buffer;
    const char* names[] = {"R", "G", "B", "A"};
    constexpr size_t pixel = 4 * sizeof(float);
    const Imath::Box2i box({window.x0, window.y0}, {window.x1 - 1, window.y1 - 1});
    for (size_t c = 0; c < 4; ++c)
        buffer.insert(names[c], Imf::Slice::Make(Imf::FLOAT, rgba.data() + c, box, pixel,
                                                 pixel * size_t(window.width())));
    composite.setFrameBuffer(buffer);
    composite.readPixels(window.y0, window.y1 - 1);
    return rgba;
}

Film deep_film(const DeepOptions& options = {}) {
    LayerSet set = test_layer_set();
    Film film(window, set);
    film.make_deep(options);
    return film;
}

void expect_flattens(const Written& w, const char* what) {
    const char* names[] = {"R", "G", "B", "A"};
    size_t first = 0;
    ASSERT_EQ(w.deep.counts.size(), window.pixel_count());
    for (size_t i = 0; i < w.deep.counts.size(); ++i) {
        const Flattened f = flattened(w.deep.samples.data() + first, w.deep.counts[i]);
        for (size_t c = 0; c < 4; ++c)
            ASSERT_NEAR(f.rgba[c], w.flat.find(names[c])->value(i), f.bound[c])
                << what << ": " << names[c] << " of pixel " << i;
        // In order, and apart
        for (size_t k = 0; k < w.deep.counts[i]; ++k) {
            const layers::DeepSample& s = w.deep.samples[first + k];
            ASSERT_LE(s.z, s.z_back);
            ASSERT_TRUE(s.a >= 0.0f && s.a <= 1.0f) << s.a;
            if (k == 0) continue;
            ASSERT_GT(s.z, w.deep.samples[first + k - 1].z_back);
        }
        first += w.deep.counts[i];
    }
    EXPECT_EQ(first, w.deep.samples.size());
}

TEST(DeepFilm, FlattensToTheImage) {
    for (const DeepOptions& options :
         {DeepOptions{}, DeepOptions{.max_samples = 1}, DeepOptions{.max_samples = 3},
          DeepOptions{.surface_tolerance = 0, .max_samples = 200}}) {
        Film film = deep_film(options);
        render_deep(film, 0, 37);
        const Written w = written(film);
        expect_flattens(w, "options");
        const std::vector<float> by_openexr =
            composited(deep_path(temporary_file("deep_test.exr")));
        const char* names[] = {"R", "G", "B", "A"};
        size_t first = 0;
        for (size_t i = 0; i < w.deep.counts.size(); first += w.deep.counts[i++]) {
            const Flattened f = flattened(w.deep.samples.data() + first, w.deep.counts[i]);
            for (size_t c = 0; c < 4; ++c)
                ASSERT_NEAR(by_openexr[4 * i + c], w.flat.find(names[c])->value(i), f.bound[c])
                    << "OpenEXR's " << names[c] << " of pixel " << i;
        }
        for (const uint32_t count : w.deep.counts)
            EXPECT_LE(count, uint32_t(options.max_samples) + 1);
    }
}

TEST(DeepFilm, IsOneHoweverItWasMade) {
    Film whole = deep_film(), parts = deep_film();
    render_deep(whole, 0, 21);
    render_deep(parts, 0, 1, true);
    render_deep(parts, 1, 8);
    render_deep(parts, 8, 21, true);
    const Written a = written(whole), b = written(parts);
    EXPECT_EQ(a.deep.counts, b.deep.counts);
    EXPECT_EQ(a.deep.samples, b.deep.samples);
}

TEST(DeepFilm, KeepsSurfacesApartAndJoinsWhatIsOne) {
    // A wall at 10 that half of the samples meet, at slightly different depths; a fog before it;
    // the sky
    LayerSet set = test_layer_set();
    set.float_layers = true;
    Film film(window, set);
    film.make_deep({});
    SampleRadiance s(set);
    PixelAccumulator accumulator(set);
    film.begin_pixel(accumulator, 0, 5, 0);
    for (int i = 0; i < 8; ++i) {
        s.clear();
        s.prim_id = 7;
        if (i < 4) {
            s.alpha = 1;
            s.cover(SampleRadiance::DepthKind::Surface, 10.0f + 0.01f * float(i));
            s.add(1, 0, Rgb(0.5f));
        } else if (i < 6) {
            s.alpha = 1;
            s.prim_id = 9;
            s.cover(SampleRadiance::DepthKind::Volume, 4.0f + 0.01f * float(i));
            s.add(1, 0, Rgb(0.25f));
        } else {
            s.add(0, 2, Rgb(2.0f));
        }
        accumulator.add(s);
    }
    film.end_pixel(accumulator);
    const Written w = written(film);
    ASSERT_EQ(w.deep.samples.size(), 3u);
    const layers::DeepSample &fog = w.deep.samples[0], &wall = w.deep.samples[1],
                             &sky = w.deep.samples[2];
    EXPECT_FLOAT_EQ(fog.z, 4.04f);
    EXPECT_FLOAT_EQ(fog.z_back, 4.05f);
    EXPECT_FLOAT_EQ(fog.a, 0.25f);
    EXPECT_FLOAT_EQ(fog.r, 0.0625f);
    EXPECT_FLOAT_EQ(wall.z, 10.015f);
    EXPECT_EQ(wall.z, wall.z_back);
    // Of the three quarters that the fog leaves, two thirds are wall
    EXPECT_FLOAT_EQ(wall.a, 2.0f / 3.0f);
    EXPECT_FLOAT_EQ(wall.r, 1.0f / 3.0f);
    EXPECT_EQ(sky.a, 0.0f);
    EXPECT_FLOAT_EQ(sky.r, 2.0f);
    EXPECT_GT(sky.z, 1e20f);
}

TEST(DeepFilm, MemoryIsBoundedByTheMostSamples) {
    Film few = deep_film({.surface_tolerance = 0, .max_samples = 4});
    render_deep(few, 0, 64);
    // Twice, for room that vectors keep; the background beside the four
    EXPECT_LE(few.deep()->memory_bytes(), window.pixel_count() * (2 * 5 * 64 + 40));
}

}  // namespace
}  // namespace velatura::film
