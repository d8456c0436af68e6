// SPDX-License-Identifier: Apache-2.0
#include "integrator/light_image.h"

#include "base/tasks.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>

namespace velatura::integrator {

namespace {

/// Photons of a task.
constexpr uint64_t chunk_size = 8192;

/// Passes of a run end at multiples of this: the samples of a pixel ask for groups of so many.
constexpr uint64_t run_alignment = 8;

/// Scatterings of a path of light tracing, about.
constexpr uint64_t usual_bounces = 3;

/// What a pass takes if half of its photons are seen.
uint64_t bytes_per_pass(uint64_t pixels,
                        uint64_t photons,
                        float filter_radius,
                        bool has_path_layers) {
    const double width = 2.0 * double(filter_radius);
    const uint64_t events = has_path_layers ? usual_bounces * sizeof(film::EventShares) : 0;
    return pixels * sizeof(uint32_t) +
           uint64_t(0.5 * double(photons) *
                    (double(sizeof(Splat) + events) + width * width * sizeof(uint32_t)));
}

}  // namespace

LightImage::LightImage(const LightTracer& tracer, const film::Window& window)
    : tracer_(tracer),
      window_(window),
      filter_(tracer.filter()),
      bytes_per_pass_(bytes_per_pass(uint64_t(window.pixel_count()),
                                     tracer.photons_per_pass(),
                                     tracer.filter().radius(),
                                     tracer.has_path_layers())) {}

template <class Visit>
void LightImage::for_each_pixel(const Splat& splat, const Visit& visit) const {
    const float radius = filter_.radius();
    const auto first = [&](float at, int lower) {
        return std::max(lower, int(std::ceil(at - 0.5f - radius)));
    };
    const auto last = [&](float at, int upper) {
        return std::min(upper - 1, int(std::floor(at - 0.5f + radius)));
    };
    const Vec2& at = splat.film_point;
    const int x0 = first(at.x, window_.x0), x1 = last(at.x, window_.x1),
              y0 = first(at.y, window_.y0), y1 = last(at.y, window_.y1);
    for (int y = y0; y <= y1; ++y)
        for (int x = x0; x <= x1; ++x)
            visit(size_t(y - window_.y0) * size_t(window_.width()) + size_t(x - window_.x0));
}

uint64_t LightImage::expected_bytes(
    uint64_t pixels, uint64_t photons, float filter_radius, bool has_path_layers, uint64_t passes) {
    const uint64_t per_pass = bytes_per_pass(pixels, photons, filter_radius, has_path_layers);
    const uint64_t at_once = std::max(max_bytes / per_pass, run_alignment);
    return per_pass * std::min(at_once, passes);
}

uint64_t LightImage::end_of_run(uint64_t begin, uint64_t end) const {
    const uint64_t count = std::max<uint64_t>(max_bytes / bytes_per_pass_, run_alignment);
    return std::min(end, (begin + count) / run_alignment * run_alignment);
}

RayCounts LightImage::trace(uint64_t begin, uint64_t end, const std::function<bool()>& is_stopped) {
    begin_ = begin;
    passes_.clear();
    passes_.resize(size_t(end - begin));
    const uint64_t photons = tracer_.photons_per_pass();
    const uint64_t chunks = (photons + chunk_size - 1) / chunk_size;
    std::vector<Splats> found(passes_.size() * size_t(chunks));
    std::mutex mutex;
    RayCounts sum;
    parallel_for(found.size(), [&](size_t i) {
        if (is_stopped()) return;
        const uint64_t pass = begin + i / chunks, first = i % chunks * chunk_size;
        RayCounts counts;
        tracer_.trace(pass, first, std::min(first + chunk_size, photons), window_, filter_.radius(),
                      found[i], counts);
        counts.effects += scene::take_effect_calls();
        const std::lock_guard lock(mutex);
        sum += counts;
    });

    // One after the other, so that the order is that of the photons
    parallel_for(passes_.size(), [&](size_t p) {
        Pass& pass = passes_[p];
        for (size_t c = 0; c < chunks; ++c) {
            Splats& chunk = found[p * size_t(chunks) + c];
            const auto before = uint32_t(pass.splats.events.size());
            for (Splat& s : chunk.splats) {
                s.events += before;
                pass.splats.splats.push_back(s);
            }
            pass.splats.events.insert(pass.splats.events.end(), chunk.events.begin(),
                                      chunk.events.end());
            chunk = {};
        }
        sort(pass);
    });
    return sum;
}

void LightImage::sort(Pass& pass) const {
    const std::vector<Splat>& splats = pass.splats.splats;
    pass.first.assign(size_t(window_.pixel_count()) + 1, 0);
    for (const Splat& s : splats) for_each_pixel(s, [&](size_t pixel) { ++pass.first[pixel + 1]; });
    for (size_t i = 1; i < pass.first.size(); ++i) pass.first[i] += pass.first[i - 1];
    pass.reaching.resize(pass.first.back());
    std::vector<uint32_t> next(pass.first.begin(), pass.first.end() - 1);
    for (size_t i = 0; i < splats.size(); ++i)
        for_each_pixel(splats[i],
                       [&](size_t pixel) { pass.reaching[next[pixel]++] = uint32_t(i); });
}

void LightImage::add(int x, int y, const LightPasses& passes, film::SampleRadiance& out) const {
    const size_t pixel = size_t(y - window_.y0) * size_t(window_.width()) + size_t(x - window_.x0);
    double scale =
        1.0 / (double(tracer_.photons_per_pass()) * double(passes.count) * double(out.weight));
    // Of filters with negative lobes a sample stands for one sign, as its own weight does
    const bool is_signed = filter_.has_negative_lobes();
    if (is_signed) {
        constexpr double negative = double(sampling::PixelFilter::negative_share);
        scale /= out.weight > 0.0f ? 1.0 - negative : negative;
    }
    film::PathLabels* const labels = out.labels();
    for (uint64_t i = 0; i < passes.count; ++i) {
        const Pass& pass = passes_[size_t(passes.first + 2 * i - begin_)];
        for (uint32_t k = pass.first[pixel]; k < pass.first[pixel + 1]; ++k) {
            const Splat& s = pass.splats.splats[pass.reaching[k]];
            const double weight =
                scale * filter_.evaluate(double(s.film_point.x) - (double(x) + 0.5),
                                         double(s.film_point.y) - (double(y) + 0.5));
            // Not what the other sign stands for, and not where there is no filter
            if (!(weight > 0.0)) continue;
            if (labels) {
                labels->begin();
                const film::EventShares* const events = &pass.splats.events[s.events];
                for (int b = 0; b + 1 < int(s.bounce); ++b) {
                    labels->look(events[b]);
                    labels->go();
                }
                labels->look(events[s.bounce - 1]);
            }
            // Photons are spread over the image: none is a firefly that a clamp is meant for
            out.add(int(s.bounce), int(s.group), s.radiance * float(weight),
                    std::numeric_limits<float>::infinity());
            if (labels) labels->stay();
        }
    }
}

}  // namespace velatura::integrator
