// SPDX-License-Identifier: Apache-2.0
#include "film/film_scene.h"

#include "base/hash.h"
#include "layers/cryptomatte.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <limits>

namespace velatura::film {

namespace {

/// Goes away with the process.
struct TemporaryFolder {
    std::filesystem::path path = std::filesystem::path(testing::TempDir()) /
                                 ("velatura_film_test_" + std::to_string(getpid()));

    TemporaryFolder() { std::filesystem::create_directories(path); }

    ~TemporaryFolder() { std::filesystem::remove_all(path); }

    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
};

float uniform(uint64_t key) {
    return float(mix64(key) >> 40) * 0x1p-24f;
}

/// The path scattered so often: by a lobe that is a function of the key, by two at once half of the
/// time.
void scatter(PathLabels& labels, int times, uint64_t key) {
    constexpr PathEvent events[] = {PathEvent::Diffuse,    PathEvent::Glossy,
                                    PathEvent::MirrorCoat, PathEvent::Refraction,
                                    PathEvent::Subsurface, PathEvent::Volume};
    labels.begin();
    for (int i = 0; i < times; ++i) {
        const uint64_t k = hash_combine(key, uint64_t(i));
        EventShares shares;
        const double part = k % 2 == 0 ? 1.0 : double(uniform(k));
        shares.add(events[k % std::size(events)], {part, part, part});
        if (part < 1.0)
            shares.add(events[(k / 7) % std::size(events)], {1 - part, 1 - part, 1 - part});
        labels.look(shares);
        labels.go();
    }
}

}  // namespace

LayerSet test_layer_set() {
    LayerSet set;
    set.last_bounce = 2;
    set.groups = {{"key", {"/World/Key"}, false},
                  {"fill", {"/World/FillA", "/World/FillB"}, false},
                  {"sky", {"/World/Sky"}, true},
                  {"emissive", {}, false},
                  {"off", {"/World/Off"}, false}};
    return set;
}

const std::vector<std::string>& test_objects() {
    static const std::vector<std::string> names = {"/World/Rock",
                                                   "/World/\xc3\xa4\xe6\x9c\xa8",
                                                   "a \"quoted\" \\ name",
                                                   "{\"x\":\"y\"}",
                                                   "line\nbreak\t\x01",
                                                   "\xf0\x9f\x8c\xb3",
                                                   "",
                                                   "/World/Rock/Moss",
                                                   "/World/Rare"};
    return names;
}

const std::string& test_object(int x, int y, uint64_t index) {
    const uint64_t key = hash_combine(hash_combine(uint64_t(x) + 11, uint64_t(y) + 5), index);
    // Some pixels see one, some many; the last one is nowhere
    const size_t choices = x % 3 == 0 ? 1 : test_objects().size() - 1;
    return test_objects()[(size_t(y) + key % choices) % (test_objects().size() - 1)];
}

void fill_sample(SampleRadiance& s, int x, int y, uint64_t index) {
    s.clear();
    const uint64_t key = hash_combine(hash_combine(uint64_t(x) + 1, uint64_t(y) + 1), index);
    s.weight = uniform(key) < 0.1f ? -0.25f : 0.9f + 0.2f * uniform(key + 1);
    if (uniform(key + 2) < 0.2f) {
        s.add(0, 2, Rgb(uniform(key + 3), 0.5f, 1.0f));
        return;
    }
    s.alpha = 1.0f;
    s.has_hit = true;
    s.albedo = Rgb(uniform(key + 4), 0.25f, 0.5f);
    s.N = Vec3(0, 0, 1);
    s.P = Vec3(float(x), float(y), uniform(key + 5));
    s.Z = 2.0f + uniform(key + 6);
    s.st = Vec2(uniform(key + 7), uniform(key + 8));
    s.prim_id = uint32_t(key % 7);
    s.matte_ids = {layers::matte_id(test_object(x, y, index)), layers::matte_id("only")};
    s.cover(uniform(key + 9) < 0.2f ? SampleRadiance::DepthKind::Volume
                                    : SampleRadiance::DepthKind::Surface,
            s.Z + float(key % 3));
    s.instance_id = uint32_t(index);
    for (int bounce = 0; bounce < 6; ++bounce) {
        for (int group = 0; group < 4; ++group) {
            const uint64_t k = hash_combine(key, uint64_t(bounce * 4 + group));
            if (bounce == 1) s.add_unoccluded(group, Rgb(2.0f, 1.5f, 1.0f + uniform(k)));
            if (uniform(k) < 0.6f) continue;
            if (PathLabels* labels = s.labels()) scatter(*labels, bounce, k);
            // Heavy tails, as path tracing has them
            const float size = std::pow(10.0f, 6.0f * uniform(k + 1) - 4.0f);
            s.add(bounce, group, Rgb(size, size * uniform(k + 2), size * uniform(k + 3)));
        }
    }
    if (x == 5 && y == 3 && index == 6) s.add(1, 0, Rgb(std::numeric_limits<float>::quiet_NaN()));
}

void render(Film& film, uint64_t first, uint64_t end, int order) {
    const Window& w = film.window();
    std::vector<std::pair<int, int>> tiles;
    for (int y = w.y0; y < w.y1; y += Film::tile_size) {
        for (int x = w.x0; x < w.x1; x += Film::tile_size) tiles.emplace_back(x, y);
    }
    if (order == 1) std::reverse(tiles.begin(), tiles.end());
    SampleRadiance sample(film.layer_set());
    PixelAccumulator accumulator(film.layer_set());
    for (const auto& [tx, ty] : tiles) {
        for (int y = ty; y < std::min(ty + Film::tile_size, w.y1); ++y) {
            for (int x = tx; x < std::min(tx + Film::tile_size, w.x1); ++x) {
                film.begin_pixel(accumulator, x, y, first);
                for (uint64_t i = first; i < end; ++i) {
                    fill_sample(sample, x, y, i);
                    accumulator.add(sample);
                }
                film.end_pixel(accumulator);
            }
        }
    }
}

std::string temporary_file(const std::string& name) {
    // Of this process alone: ctest runs tests side by side, and so do several builds on one machine
    static const TemporaryFolder folder;
    return (folder.path / name).string();
}

}  // namespace velatura::film
