// SPDX-License-Identifier: Apache-2.0
#include "display/film_display.h"

#include "accumulate/pixel_means.h"
#include "base/nearest_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <utility>

namespace velatura::display {

namespace {

using std::chrono::milliseconds;

constexpr int tile_size = 32;  // pixels, as the schedule's usual tiles
constexpr milliseconds connect_patience(500), look_again(2000), send_patience(100);

std::vector<std::string> channel_names(const std::vector<accumulate::LayerSource>& layers) {
    std::vector<std::string> names = {"R", "G", "B", "A"};
    for (const accumulate::LayerSource& layer : layers)
        for (const char* c : {".R", ".G", ".B"}) names.push_back(layer.entry.name + c);
    return names;
}

/// As LayerSource describes it, without clamps.
accumulate::Triple sum_of(const accumulate::SampleSums& sums,
                          const accumulate::LayerSource& layer,
                          int x,
                          int y) {
    accumulate::Triple sum;
    for (const uint32_t a : layer.plus) sum += sums.total(x, y, a);
    for (const uint32_t a : layer.minus) {
        const accumulate::Triple less = sums.total(x, y, a);
        sum += {-less.x, -less.y, -less.z};
    }
    return sum;
}

}  // namespace

Result<std::vector<accumulate::LayerSource>> find_layers(const film::LayerSet& set,
                                                         const std::vector<std::string>& names) {
    const accumulate::AccumulatorTable table(set);
    const std::vector<accumulate::LayerSource> all = accumulate::light_sources(set, table);
    std::vector<accumulate::LayerSource> found;
    for (const std::string& name : names) {
        const auto at = std::find_if(all.begin(), all.end(),
                                     [&](const auto& layer) { return layer.entry.name == name; });
        if (at == all.end()) {
            std::vector<std::string> known;
            for (const accumulate::LayerSource& layer : all) known.push_back(layer.entry.name);
            return Error{"unknown-layer", fmt::format("the render has no light layer \"{}\"{}",
                                                      name, did_you_mean(name, known))};
        }
        found.push_back(*at);
    }
    return found;
}

FilmDisplay::FilmDisplay(DisplayOptions options)
    : options_(std::move(options)),
      channels_(channel_names(options_.layers)),
      connection_(options_.address) {
    const image::Window& w = options_.display;
    values_.assign(w.pixel_count() * channels_.size(), 0.0f);
    for (int y = w.y0; y < w.y1; y += tile_size)
        for (int x = w.x0; x < w.x1; x += tile_size)
            tiles_.push_back(
                {{x, y, std::min(x + tile_size, w.x1), std::min(y + tile_size, w.y1)}});
}

FilmDisplay::~FilmDisplay() {
    if (thread_.joinable()) finish(milliseconds(0));
}

Result<void> FilmDisplay::start() {
    thread_ = std::thread([this] { run(); });
    std::unique_lock lock(mutex_);
    if (!changed_.wait_for(lock, 2 * connect_patience, [this] { return first_try_.has_value(); }))
        return Error{"display-unreachable",
                     fmt::format("no answer from {} yet", options_.address.text())};
    return *first_try_;
}

void FilmDisplay::add_tile(const film::Film& film, const image::Window& tile) {
    const image::Window& w = options_.display;
    const image::Window seen{std::max(tile.x0, w.x0), std::max(tile.y0, w.y0),
                             std::min(tile.x1, w.x1), std::min(tile.y1, w.y1)};
    if (seen.x0 >= seen.x1 || seen.y0 >= seen.y1) return;
    const accumulate::SampleSums& sums = film.sums();
    std::vector<float> values;
    values.reserve(seen.pixel_count() * channels_.size());
    for (int y = seen.y0; y < seen.y1; ++y) {
        for (int x = seen.x0; x < seen.x1; ++x) {
            const accumulate::Triple coverage =
                sums.total(x, y, accumulate::AccumulatorTable::coverage);
            const auto put = [&](const accumulate::Triple& sum) {
                for (const float v : accumulate::mean_of(sum, coverage)) values.push_back(v);
            };
            put(sums.total(x, y, accumulate::AccumulatorTable::beauty));
            const double weight = accumulate::weight_of(coverage);
            values.push_back(weight == 0.0 ? 0.0f : float(coverage.x / weight));
            for (const accumulate::LayerSource& layer : options_.layers)
                put(sum_of(sums, layer, x, y));
        }
    }
    const std::lock_guard lock(mutex_);
    const size_t width = size_t(seen.width()) * channels_.size();
    for (int y = seen.y0; y < seen.y1; ++y) {
        const size_t from = size_t(y - seen.y0) * width,
                     to = (size_t(y - w.y0) * size_t(w.width()) + size_t(seen.x0 - w.x0)) *
                          channels_.size();
        std::copy_n(values.begin() + std::ptrdiff_t(from), width,
                    values_.begin() + std::ptrdiff_t(to));
    }
    for (Tile& of_display : tiles_) {
        const image::Window& t = of_display.window;
        const bool is_touched =
            t.x0 < seen.x1 && seen.x0 < t.x1 && t.y0 < seen.y1 && seen.y0 < t.y1;
        if (is_touched) of_display.is_known = of_display.is_new = true;
    }
}

/// The viewer has none of it.
void FilmDisplay::begin_image() {
    packet_ =
        create_image(options_.name, options_.display.width(), options_.display.height(), channels_);
    sent_ = 0;
    const std::lock_guard lock(mutex_);
    for (Tile& tile : tiles_) {
        tile.is_new = tile.is_known;
        tile.sent = {};
    }
}

/// The next tile that the viewer lacks. Returns: whether there is one.
bool FilmDisplay::take_packet() {
    const image::Window& w = options_.display;
    std::vector<float> values;
    image::Window window;
    {
        const std::lock_guard lock(mutex_);
        const Clock::time_point now = Clock::now();
        const auto at = std::find_if(tiles_.begin(), tiles_.end(), [&](const Tile& tile) {
            return tile.is_new && (is_ending_ || now - tile.sent >= options_.interval);
        });
        if (at == tiles_.end()) return false;
        at->is_new = false;
        at->sent = now;
        window = at->window;
        const size_t width = size_t(window.width()) * channels_.size();
        for (int y = window.y0; y < window.y1; ++y) {
            const auto row =
                values_.begin() +
                std::ptrdiff_t((size_t(y - w.y0) * size_t(w.width()) + size_t(window.x0 - w.x0)) *
                               channels_.size());
            values.insert(values.end(), row, row + std::ptrdiff_t(width));
        }
    }
    packet_ = update_image(options_.name,
                           {window.x0 - w.x0, window.y0 - w.y0, window.x1 - w.x0, window.y1 - w.y0},
                           channels_, values);
    sent_ = 0;
    return true;
}

void FilmDisplay::run() {
    Clock::time_point next_look = Clock::now();
    for (;;) {
        bool has_sent_all = false;
        Clock::time_point end;
        {
            const std::lock_guard lock(mutex_);
            end = end_;
        }
        connection_.notice_end();
        if (!connection_.is_open() && Clock::now() >= next_look) {
            next_look = Clock::now() + look_again;
            const Result<void> opened = connection_.open(connect_patience);
            if (opened) begin_image();
            const std::lock_guard lock(mutex_);
            if (!first_try_) first_try_ = opened;
            changed_.notify_all();
        }
        while (connection_.is_open() && Clock::now() < end) {
            if (sent_ == packet_.size() && !take_packet()) {
                has_sent_all = true;
                break;
            }
            const size_t taken = connection_.send(std::span(packet_).subspan(sent_), send_patience);
            sent_ += taken;
            if (taken == 0) break;
            const std::lock_guard lock(mutex_);
            end = end_;
        }
        std::unique_lock lock(mutex_);
        has_all_sent_ = has_sent_all;
        if (is_ending_ && (has_sent_all || !connection_.is_open() || Clock::now() >= end_)) return;
        changed_.wait_for(lock, options_.interval, [this] { return is_ending_; });
    }
}

bool FilmDisplay::finish(milliseconds patience) {
    {
        const std::lock_guard lock(mutex_);
        is_ending_ = true;
        end_ = Clock::now() + patience;
    }
    changed_.notify_all();
    if (thread_.joinable()) thread_.join();
    connection_.close();
    return has_all_sent_;
}

}  // namespace velatura::display
