// SPDX-License-Identifier: Apache-2.0
#include "layers/top_up.h"

#include "base/atomic_file.h"
#include "base/check.h"
#include "base/json_depth.h"
#include "base/tasks.h"
#include "image/exr.h"
#include "layers/layer_file.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <filesystem>
#include <numeric>

namespace velatura::layers {

namespace {

namespace fs = std::filesystem;

constexpr const char* schema = "velatura.topup/1";
constexpr const char* priority_name = "priority";
constexpr const char* present_name = "present";
constexpr int tile_size = 4;                 // pixels that share a factor of proportion
constexpr double max_samples = 0xffffffffu;  // what the map's counts have room for

/// A pixel's count as the factor of proportion grows: what is there, then powers of two. The factor
/// is 2^(step / steps_per_octave).
class Ladder {
  public:
    static constexpr int steps_per_octave = 64;
    static constexpr int lowest_octave = -64, highest_octave = 96;
    static constexpr int steps = (highest_octave - lowest_octave) * steps_per_octave + 1;

    Ladder(float priority, uint64_t present, int highest_power)
        : present_(present), highest_(highest_power) {
        // Beyond that range priorities say nothing any more
        constexpr double range = 0x1p48;
        has_priority_ = priority > 0.0f && std::isfinite(priority);
        if (has_priority_) log_ = std::log2(std::clamp(double(priority), 1.0 / range, range));
        first_ = std::bit_width(present);
    }

    uint64_t count(int step) const {
        if (!has_priority_ || first_ > highest_) return present_;
        int power = int(std::floor(double(step) / steps_per_octave + lowest_octave + log_ + 0.5));
        power = std::clamp(power, first_ - 1, highest_);
        // Rounding must not make this another function than add_gains sums
        while (power >= first_ && step_of(power) > step) --power;
        while (power < highest_ && step_of(power + 1) <= step) ++power;
        return power >= first_ ? uint64_t(1) << power : present_;
    }

    /// Adds what the count gains at each step.
    void add_gains(std::vector<double>& gains) const {
        if (!has_priority_) return;
        for (int power = first_; power <= highest_; ++power) {
            const uint64_t before = power == first_ ? present_ : uint64_t(1) << (power - 1);
            const int step = step_of(power);
            if (step < steps) gains[size_t(step)] += double((uint64_t(1) << power) - before);
        }
    }

  private:
    /// The first step at which 2^power samples are nearer than half as many.
    int step_of(int power) const {
        const double octave = double(power) - 0.5 - log_ - lowest_octave;
        return std::max(0, int(std::ceil(octave * steps_per_octave)));
    }

    uint64_t present_;
    int first_ = 0, highest_;  ///< powers above what is there
    bool has_priority_ = false;
    double log_ = 0;
};

/// What the whole image has gained at each step.
std::vector<double> totals_of(const std::vector<Ladder>& ladders) {
    std::vector<double> totals(size_t(Ladder::steps), 0.0);
    for (const Ladder& ladder : ladders) ladder.add_gains(totals);
    for (size_t step = 1; step < totals.size(); ++step) totals[step] += totals[step - 1];
    return totals;
}

image::Window grown(const image::Window& tile, const image::Window& within) {
    return {
        std::max(tile.x0 - top_up_reach, within.x0), std::max(tile.y0 - top_up_reach, within.y0),
        std::min(tile.x1 + top_up_reach, within.x1), std::min(tile.y1 + top_up_reach, within.y1)};
}

fs::path map_name(const std::string& path) {
    return fs::path(path).stem().string() + ".priority.exr";
}

}  // namespace

std::vector<uint64_t> place_samples(const image::Window& window,
                                    const std::vector<float>& priority,
                                    const std::vector<uint64_t>& present,
                                    double mean) {
    const size_t pixels = window.pixel_count();
    VELATURA_CHECK(priority.size() == pixels && present.size() == pixels, "one value per pixel");
    // Neither what is no number nor what no request may ask for has a power of two
    mean = mean > 0.0 ? std::min(mean, max_samples) : 0.0;
    // No pixel gets more than 16 times the mean: few neighbors tell how noisy it is
    const int highest = std::clamp(int(std::floor(std::log2(std::max(mean, 1.0)))) + 4, 4, 31);
    std::vector<Ladder> ladders;
    ladders.reserve(pixels);
    for (size_t i = 0; i < pixels; ++i) ladders.emplace_back(priority[i], present[i], highest);
    // All are whole numbers below 2^53: sums are exact, and so are their differences
    const std::vector<double> totals = totals_of(ladders);
    const double there = std::accumulate(present.begin(), present.end(), 0.0);

    std::vector<uint64_t> counts(present);
    const int columns = (window.width() + tile_size - 1) / tile_size;
    const int rows = (window.height() + tile_size - 1) / tile_size;
    parallel_for(size_t(columns) * size_t(rows), [&](size_t t) {
        image::Window tile;
        tile.x0 = window.x0 + int(t % size_t(columns)) * tile_size;
        tile.y0 = window.y0 + int(t / size_t(columns)) * tile_size;
        tile.x1 = std::min(tile.x0 + tile_size, window.x1);
        tile.y1 = std::min(tile.y0 + tile_size, window.y1);
        const image::Window near = grown(tile, window);
        const double far_pixels = double(pixels) - double(near.pixel_count());
        // Samples that the pixels further away gain up to a step
        const auto gain = [&](int step) {
            double sum = totals[size_t(step)];
            for (int y = near.y0; y < near.y1; ++y) {
                for (int x = near.x0; x < near.x1; ++x) {
                    const size_t i = window.index(x, y);
                    sum -= double(ladders[i].count(step) - present[i]);
                }
            }
            return sum;
        };
        double max = mean * far_pixels - there;
        for (int y = near.y0; y < near.y1; ++y) {
            for (int x = near.x0; x < near.x1; ++x) max += double(present[window.index(x, y)]);
        }
        int below = -1,
            above = Ladder::steps;  // the last step that is not too far, and the first one that is
        while (above - below > 1) {
            const int middle = (above + below) / 2;
            (gain(middle) <= max ? below : above) = middle;
        }
        for (int y = tile.y0; y < tile.y1; ++y) {
            for (int x = tile.x0; x < tile.x1; ++x) {
                const size_t i = window.index(x, y);
                // Where nothing is further away, nothing tells the factor
                if (far_pixels == 0)
                    counts[i] = std::max(present[i], uint64_t(std::llround(mean)));
                else if (below >= 0)
                    counts[i] = ladders[i].count(below);
            }
        }
    });
    return counts;
}

Result<void> write_top_up(const std::string& path, const TopUpRequest& request) {
    const bool has_room = std::all_of(request.present.begin(), request.present.end(),
                                      [](uint64_t n) { return double(n) <= max_samples; });
    if (!has_room || !(request.samples >= 0.0 && request.samples <= max_samples))
        return Error{"bad-request", fmt::format("{}: {} samples per pixel exceed the maximum", path,
                                                request.samples)};
    image::Image map;
    map.data = map.display = request.window;
    image::Part part;
    image::Channel priority, present;
    priority.name = priority_name;
    priority.data = request.priority;
    present.name = present_name;
    present.data = std::vector<uint32_t>(request.present.begin(), request.present.end());
    part.channels.push_back(std::move(present));
    part.channels.push_back(std::move(priority));
    map.parts.push_back(std::move(part));
    const fs::path name = map_name(path);
    const fs::path folder = fs::path(path).parent_path();
    if (auto written = write_image_file((folder / name).string(), map); !written) return written;
    nlohmann::ordered_json j;
    j["schema"] = schema;
    j["sceneHash"] = request.scene_hash;
    j["settingsHash"] = request.settings_hash;
    j["samples"] = request.samples;
    j["map"] = name.string();
    j["look"] = nlohmann::ordered_json::parse(request.look_json, nullptr, false);
    return write_file_atomically(path, j.dump(2) + "\n");
}

Result<TopUpRequest> read_top_up(const std::string& path) {
    const auto text = read_file(path);
    if (!text) return text.error();
    const auto bad = [&path](const char* why) {
        return Error{"bad-request", fmt::format("{}: {}", path, why)};
    };
    if (is_json_too_deep(*text)) return bad("the request is nested too deeply");
    const auto j = nlohmann::ordered_json::parse(*text, nullptr, false);
    if (!j.is_object() || j.value("schema", nlohmann::ordered_json()) != schema)
        return bad("not a request file of `velatura-comp request`");
    TopUpRequest request;
    fs::path name;
    try {
        request.scene_hash = j.at("sceneHash").get<std::string>();
        request.settings_hash = j.at("settingsHash").get<std::string>();
        request.samples = j.at("samples").get<double>();
        request.look_json = j.at("look").dump();
        // Only a name beside the file itself, never a path out of its folder
        name = fs::path(j.at("map").get<std::string>()).filename();
    } catch (const nlohmann::json::exception&) {
        return bad("the request is damaged");
    }
    const auto map = image::read_exr((fs::path(path).parent_path() / name).string());
    if (!map) return map.error();
    const image::Channel* priority = map->find(priority_name);
    const image::Channel* present = map->find(present_name);
    const auto* values = priority ? std::get_if<std::vector<float>>(&priority->data) : nullptr;
    const auto* counts = present ? std::get_if<std::vector<uint32_t>>(&present->data) : nullptr;
    if (!values || !counts || !(request.samples >= 0.0 && request.samples <= max_samples))
        return bad("the request is damaged");
    request.window = map->data;
    request.priority = *values;
    request.present.assign(counts->begin(), counts->end());
    return request;
}

}  // namespace velatura::layers
