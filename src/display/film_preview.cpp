// SPDX-License-Identifier: Apache-2.0
#include "display/film_preview.h"

#include "accumulate/pixel_means.h"
#include "image/formats.h"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace velatura::display {

PreviewImage scaled_down(const PreviewImage& image, int max_width, int max_height) {
    const auto parts = [](int size, int most) { return (size + most - 1) / std::max(most, 1); };
    const int k = std::max({parts(image.width, max_width), parts(image.height, max_height), 1});
    if (k == 1) return image;
    PreviewImage out;
    out.width = (image.width + k - 1) / k;
    out.height = (image.height + k - 1) / k;
    out.rgb.reserve(size_t(out.width) * size_t(out.height) * 3);
    for (int y = 0; y < out.height; ++y) {
        for (int x = 0; x < out.width; ++x) {
            const int x1 = std::min((x + 1) * k, image.width),
                      y1 = std::min((y + 1) * k, image.height);
            const unsigned count = unsigned((x1 - x * k) * (y1 - y * k));
            for (size_t c = 0; c < 3; ++c) {
                unsigned sum = 0;
                for (int v = y * k; v < y1; ++v)
                    for (int u = x * k; u < x1; ++u)
                        sum += image.rgb[(size_t(v) * size_t(image.width) + size_t(u)) * 3 + c];
                out.rgb.push_back(uint8_t((sum + count / 2) / count));
            }
        }
    }
    return out;
}

FilmPreview::FilmPreview(PreviewOptions options, image::DisplayTransform transform)
    : options_(std::move(options)),
      transform_(std::move(transform)),
      rgb_(3 * options_.display.pixel_count(), 0.0f),
      thread_([this] { run(); }) {}

FilmPreview::~FilmPreview() {
    {
        const std::lock_guard lock(mutex_);
        is_ending_ = is_dropped_ = true;
    }
    changed_.notify_all();
    if (thread_.joinable()) thread_.join();
}

void FilmPreview::add_tile(const film::Film& film, const image::Window& tile) {
    const image::Window& w = options_.display;
    const image::Window seen{std::max(tile.x0, w.x0), std::max(tile.y0, w.y0),
                             std::min(tile.x1, w.x1), std::min(tile.y1, w.y1)};
    if (seen.is_empty()) return;
    const accumulate::SampleSums& sums = film.sums();
    std::vector<float> values;
    values.reserve(3 * seen.pixel_count());
    for (int y = seen.y0; y < seen.y1; ++y) {
        for (int x = seen.x0; x < seen.x1; ++x) {
            const auto mean =
                accumulate::mean_of(sums.total(x, y, accumulate::AccumulatorTable::beauty),
                                    sums.total(x, y, accumulate::AccumulatorTable::coverage));
            values.insert(values.end(), mean.begin(), mean.end());
        }
    }
    const std::lock_guard lock(mutex_);
    const size_t row = 3 * size_t(seen.width());
    for (int y = seen.y0; y < seen.y1; ++y)
        std::copy_n(values.begin() + std::ptrdiff_t(size_t(y - seen.y0) * row), row,
                    rgb_.begin() + std::ptrdiff_t(3 * w.index(seen.x0, y)));
    is_new_ = true;
}

void FilmPreview::make_image() {
    std::vector<float> rgb;
    {
        const std::lock_guard lock(mutex_);
        rgb = rgb_;
        is_new_ = false;
    }
    transform_.apply(rgb);
    const image::Window& w = options_.display;
    if (options_.show) {
        PreviewImage shown{w.width(), w.height(), {}};
        shown.rgb.resize(rgb.size());
        std::transform(rgb.begin(), rgb.end(), shown.rgb.begin(), image::display_byte);
        options_.show(shown);
    }
    if (options_.file.empty()) return;
    image::DisplayImage file;
    file.width = w.width();
    file.height = w.height();
    file.values = std::move(rgb);
    file.pixel_aspect = options_.pixel_aspect;
    written_ = image::write_display_image(options_.file, file);
}

void FilmPreview::run() {
    std::unique_lock lock(mutex_);
    while (true) {
        changed_.wait_for(lock, options_.interval, [this] { return is_ending_; });
        if (is_dropped_) return;
        const bool is_last = is_ending_;
        if (is_new_ || is_last) {
            lock.unlock();
            make_image();
            lock.lock();
        }
        if (is_last) return;
    }
}

Result<void> FilmPreview::finish() {
    {
        const std::lock_guard lock(mutex_);
        is_ending_ = true;
    }
    changed_.notify_all();
    if (thread_.joinable()) thread_.join();
    return written_;
}

}  // namespace velatura::display
