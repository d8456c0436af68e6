// SPDX-License-Identifier: Apache-2.0
#include "app/memory_needs.h"

#include "app/image_needs.h"
#include "app/progress.h"
#include "base/process/memory_limit.h"
#include "image/exr.h"

#include <fmt/format.h>

#include <algorithm>

namespace velatura::app {

namespace {

/// Of textures that do not fit into it, a cache of this size still holds what a few tiles of the
/// image show.
constexpr size_t min_cache = size_t(32) << 20;

size_t rest_of(size_t whole, size_t part) {
    return whole > part ? whole - part : 0;
}

}  // namespace

std::string MemoryNeeds::text() const {
    std::string text = fmt::format("{}: {} program, scene and BVH, {} film, {} writing the image",
                                   format_bytes(total()), format_bytes(now), format_bytes(film),
                                   format_bytes(writing));
    if (splats > 0) text += fmt::format(", {} light tracing", format_bytes(splats));
    if (textures > 0) text += fmt::format(", {} textures", format_bytes(textures));
    return text;
}

MemoryNeeds expected_memory(const RenderJob& job,
                            const FrameInput& input,
                            const shading::TextureCache& textures,
                            size_t film_bytes) {
    const ImageNeeds image = image_needs(job, input);
    MemoryNeeds needs;
    needs.now = resident_bytes();
    needs.film = rest_of(image.film_bytes, film_bytes);
    needs.splats = image.splat_bytes;
    needs.writing = image.writing_bytes;
    needs.textures = std::min(textures.whole_bytes(), textures.memory_bytes());
    return needs;
}

size_t MemoryNeeds::min() const {
    return now + film / 4 + splats / 4 + writing / 2 + std::min(textures, min_cache);
}

void allot_textures(const shading::TextureCache& textures, MemoryNeeds& needs) {
    const size_t left = rest_of(MemoryLimit::allowed(), needs.total() - needs.textures);
    if (!MemoryLimit::is_set() || needs.textures <= left) return;
    needs.textures = std::min(needs.textures, std::max(left, min_cache));
    textures.set_memory(needs.textures);
}

MemoryNeeds allot_memory(const RenderJob& job,
                         const FrameInput& input,
                         const shading::TextureCache& textures,
                         size_t film_bytes,
                         Diagnostics& diagnostics) {
    MemoryLimit::enforce(
        "while tracing trial paths (--guiding off and --splitting off avoid them)");
    MemoryNeeds needs = expected_memory(job, input, textures, film_bytes);
    allot_textures(textures, needs);
    if (MemoryLimit::is_set() && needs.total() > MemoryLimit::allowed() &&
        needs.min() <= MemoryLimit::allowed())
        diagnostics.warn("memory-limit", {}, {},
                         fmt::format("the render can need {}, above --memory-limit {}; if it "
                                     "reaches the limit, it stops and writes what it has",
                                     needs.text(), format_bytes(MemoryLimit::allowed())));
    return needs;
}

bool fits_limit(const MemoryNeeds& needs, Diagnostics& diagnostics) {
    if (!MemoryLimit::is_set() || needs.min() <= MemoryLimit::allowed()) return true;
    diagnostics.error(
        "memory-limit", {}, {},
        fmt::format("the render needs {}, above --memory-limit {}; nothing is rendered",
                    needs.text(), format_bytes(MemoryLimit::allowed())));
    return false;
}

void warn_of_memory(const RenderJob& job,
                    const MemoryNeeds& needs,
                    const film::NoiseEstimate& noise,
                    Diagnostics& diagnostics) {
    const integrator::RenderOptions& schedule = job.settings.schedule;
    diagnostics.warn(
        "memory-limit", {}, {},
        fmt::format(
            "stopped at --memory-limit {} after {:g}{} samples per pixel; the whole render was "
            "expected to need {}",
            format_bytes(MemoryLimit::allowed()), noise.samples_mean,
            schedule.is_open_ended ? std::string() : fmt::format(" of {}", schedule.end_sample),
            needs.text()));
}

bool MemoryWatch::has_plenty_to_write() const {
    return !MemoryLimit::is_set() || MemoryLimit::left() > 2 * reserve_ + MemoryLimit::kept_bytes;
}

void MemoryWatch::make_room() {
    // Closing files takes a little memory, too
    MemoryLimit::watch();
    textures_.drop_tiles();
    image::use_one_exr_thread();
    MemoryLimit::give_back();
}

bool MemoryWatch::keeps_limit() {
    if (!MemoryLimit::is_set()) return true;
    const size_t left = MemoryLimit::left();
    if (left > reserve_) return true;
    const auto now = Clock::now();
    if (!given_up_) {
        given_up_ = now;
        textures_.set_memory(min_cache);
        return true;
    }
    // Tiles go when others come; where nothing could be written any more there is no time to wait
    // for that
    constexpr auto patience = std::chrono::seconds(1);
    if (left > MemoryLimit::kept_bytes && now - *given_up_ < patience) return true;
    MemoryLimit::give_back();
    return MemoryLimit::left() > reserve_;
}

}  // namespace velatura::app
