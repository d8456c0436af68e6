// SPDX-License-Identifier: Apache-2.0
#include "plugins/openimageio/in_process_source.h"

#include "base/limits.h"
#include "base/process/mapping_guard.h"
#include "plugins/openimageio/sandbox/messages.h"

#include <OpenImageIO/imageio.h>
#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <new>
#include <utility>
#include <vector>

namespace velatura::plugins::openimageio {

namespace {

double stored_bytes(StoredAs stored) {
    switch (stored) {
        case StoredAs::UInt8:
            return 1;
        case StoredAs::UInt16:
        case StoredAs::Half:
            return 2;
        default:
            return 4;
    }
}

double level_bytes(const LevelSpec& level) {
    const bool is_tiled = level.tile_width > 0;
    const auto side = [](int32_t pixels) { return double(std::max(pixels, 0)); };
    return side(is_tiled ? level.tile_width : level.width) *
           side(is_tiled ? level.tile_height : level.height) * side(level.channels) *
           stored_bytes(level.stored);
}

/// A program that survives files that are truncated while they are mapped has a handler for it; the
/// plugin maps files too, and has its own list of them.
void survive_mapping_guard_as_the_program_does() {
    struct sigaction action {};

    if (::sigaction(SIGBUS, nullptr, &action) == 0 && (action.sa_flags & SA_SIGINFO) != 0)
        read_truncated_pages_as_zeros();
}

/// Whether zeros stand for some bytes of this file, or of the package that it is in.
bool is_truncated(const std::string& asset) {
    const std::vector<std::string> files = truncated_files();
    return std::any_of(files.begin(), files.end(), [&](const std::string& file) {
        return asset == file || asset.starts_with(file + '[');
    });
}

bool has_memory_limit() {
    rlimit limit = {};
    return ::getrlimit(RLIMIT_DATA, &limit) == 0 && limit.rlim_cur < limit.rlim_max;
}

/// What decoder processes answer in the same case: their message on one line, or how they ended.
/// Memory that the renderer's own limit refuses is no error of the image, unless the texture cache
/// calls, which no exception must leave (MemoryLimit::Exemption).
template <class Decode>
auto decode(const char* code, const std::string& asset, ImageUse use, const Decode& step)
    -> decltype(step()) {
    try {
        decltype(step()) done = step();
        if (is_truncated(asset)) return Error{code, "the file was truncated while it was read"};
        if (!done) return Error{code, plain_reason(done.error().message)};
        return done;
    } catch (const std::bad_alloc&) {
        if (use == ImageUse::Image && has_memory_limit()) throw;
        return Error{code, "reading ran out of memory"};
    }
}

class InProcessImage final : public SourceImage {
  public:
    InProcessImage(std::string asset, ImageUse use, std::unique_ptr<SourceImage> image)
        : asset_(std::move(asset)), use_(use), image_(std::move(image)) {}

    const SourceSpec& spec() const override { return image_->spec(); }

    Result<void> read_lines(
        int level, int y, int y_end, int channels, std::span<float> values) override {
        return decode("image-read", asset_, use_,
                      [&] { return image_->read_lines(level, y, y_end, channels, values); });
    }

    Result<void> read_tile(
        int level, int x, int y, int channels, std::span<float> values) override {
        return decode("image-read", asset_, use_,
                      [&] { return image_->read_tile(level, x, y, channels, values); });
    }

  private:
    std::string asset_;
    ImageUse use_;
    std::unique_ptr<SourceImage> image_;
};

}  // namespace

double decoder_bytes(const SourceSpec& spec) {
    double max = 0;
    for (const LevelSpec& level : spec.levels) max = std::max(max, level_bytes(level));
    return max;
}

InProcessSource::InProcessSource(ImageSource& decoder_processes)
    : decoder_processes_(decoder_processes), limit_bytes_(DecodeLimits().bytes) {
    survive_mapping_guard_as_the_program_does();
    OIIO::attribute("threads", 1);
    // 0: the number of OpenEXR's threads, which the renderer shares, stays as it is
    OIIO::attribute("exr_threads", 0);
}

Result<std::unique_ptr<SourceImage>> InProcessSource::open(const std::string& asset, ImageUse use) {
    if (asset.size() > max_name_bytes) return Error{"image-open", "its name is too long"};
    Result<std::unique_ptr<SourceImage>> opened =
        decode("image-open", asset, use, [&] { return files_.open(asset, use); });
    if (!opened) return opened;
    if (decoder_bytes((*opened)->spec()) > double(limit_bytes_.load()))
        return decoder_processes_.open(asset, use);
    return std::unique_ptr<SourceImage>(new InProcessImage(asset, use, std::move(*opened)));
}

}  // namespace velatura::plugins::openimageio
