// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "image/image.h"

#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace velatura::layers {

/// A channel of an image by its place.
struct ChannelRef {
    size_t part = 0, channel = 0;

    bool operator==(const ChannelRef&) const = default;
};

/// Values of a channel over some rows: [rows][width of the data window].
struct StripChannel {
    image::ChannelType type = image::ChannelType::Float;
    const void* values = nullptr;
};

/// Rows [y0, y1) of some channels, in the order in which they were asked for.
struct Strip {
    int y0 = 0, y1 = 0;
    std::vector<StripChannel> channels;
};

/// A file of layers, with the files beside it for the split layout, whose pixels stay on disk.
/// Nothing stays open between calls; a file that has changed since open() is an error ("io-read").
class StripReader {
  public:
    /// Errors: "io-open", "io-read".
    static Result<StripReader> open(const std::string& path);
    /// Several files as parts of one image. Attributes are those of the first, without ours; what
    /// the others say stands with the first part of each. Errors: also "files-differ" (other
    /// display windows or pixel aspects).
    static Result<StripReader> open_together(std::span<const std::string> paths);
    ~StripReader();
    StripReader(StripReader&&) noexcept;
    StripReader& operator=(StripReader&&) noexcept;

    /// The file as read_layer_file gives it, with channels that have no values. The data window
    /// holds those of all parts: a part is 0 outside its own.
    const image::Image& description() const;

    /// Names of the parts that were left out and have no channels here: exact sums over other
    /// pixels than the first part's, and parts so far off that the image would be many times
    /// larger than what is stored.
    const std::vector<std::string>& foreign_parts() const;

    /// Names of deep parts, which are skipped.
    const std::vector<std::string>& deep_parts() const;

    /// Which of the files opened together a part is of.
    size_t file_of(size_t part) const;

    /// Calls body for all strips of the data window, in any order and from several threads at once;
    /// a strip is gone after its call. `channels` names each once. Readers take at most
    /// `memory_bytes` together, or what one of them needs where that is more. Errors: "io-read".
    Result<void> read(std::span<const ChannelRef> channels,
                      const std::function<void(const Strip&)>& body,
                      size_t memory_bytes = size_t(1) << 30) const;

    /// The whole image. Errors: "io-read".
    Result<image::Image> read_all() const;

  private:
    struct Impl;
    explicit StripReader(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

/// The same strips of an image in memory.
void for_each_strip(const image::Image& image,
                    std::span<const ChannelRef> channels,
                    const std::function<void(const Strip&)>& body);

}  // namespace velatura::layers
