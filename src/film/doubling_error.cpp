// SPDX-License-Identifier: Apache-2.0
#include "film/doubling_error.h"

#include "image/pixel_means.h"

#include <array>
#include <bit>

namespace velatura::film {

namespace {

using image::AccumulatorTable;
using image::Triple;

/// Pixels are dealt to so many parts, all of which see the whole picture: what they differ by is noise.
constexpr size_t part_count = 16;

/// Black where no sample was valid.
Triple mean_of(const image::SampleSums& sums, int x, int y) {
    const double weight = image::weight_of(sums.total(x, y, AccumulatorTable::coverage));
    if (weight == 0.0) return {};
    const Triple sum = sums.total(x, y, AccumulatorTable::beauty);
    return {sum.x / weight, sum.y / weight, sum.z / weight};
}

}  // namespace

DoublingError::DoublingError(const Window& window)
    : window_(window), means_(3 * window.pixel_count()), powers_(window.pixel_count()) {}

void DoublingError::keep(const Film& film, int x, int y) {
    const image::PixelRecord& record = film.sums().record(x, y);
    if (record.first != 0 || !std::has_single_bit(record.end)) return;
    const size_t i = window_.index(x, y);
    const Triple mean = mean_of(film.sums(), x, y);
    means_[3 * i] = float(mean.x);
    means_[3 * i + 1] = float(mean.y);
    means_[3 * i + 2] = float(mean.z);
    powers_[i] = uint8_t(std::bit_width(record.end));
}

std::optional<image::RelativeError> DoublingError::observe(const Film& film) const {
    const Window& w = window_;
    std::array<double, part_count> squares{}, counts{};
    for (int y = w.y0; y < w.y1; ++y) {
        for (int x = w.x0; x < w.x1; ++x) {
            const size_t i = w.index(x, y);
            const image::PixelRecord& record = film.sums().record(x, y);
            const int doublings = std::bit_width(record.end) - int(powers_[i]);
            if (!std::has_single_bit(record.end) || powers_[i] == 0 || doublings < 1)
                return std::nullopt;
            const double times = double((uint64_t(1) << doublings) - 1);
            const Triple m = mean_of(film.sums(), x, y);
            const double now[3] = {m.x, m.y, m.z};
            const size_t part = size_t((x - w.x0) + 5 * (y - w.y0)) % part_count;
            for (size_t c = 0; c < 3; ++c) {
                const auto before = double(means_[3 * i + c]);
                const double change = now[c] - before, since = now[c] + change / times;
                squares[part] += image::relative_square_of_two(change * change / times, before, since);
            }
            counts[part] += 3;
        }
    }
    image::RelativeErrorSum error;
    for (size_t part = 0; part < part_count; ++part) error.add_tile(squares[part], counts[part]);
    return error.result();
}

}  // namespace velatura::film
