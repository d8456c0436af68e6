// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "plugins/openimageio/file_source.h"

#include <atomic>
#include <cstddef>
#include <memory>
#include <string>

namespace velatura::plugins::openimageio {

/// What a decoder may hold of an image at once, by what its header says: all of a level that is not
/// tiled, as stored, or one tile.
double decoder_bytes(const SourceSpec& spec);

/// Decodes in the renderer, for scenes that are trusted: a decoder that crashes or hangs does that
/// to the render. Values and messages are those of decoder processes, and images that may take too
/// much of the renderer's memory are decoded there.
class InProcessSource final : public ImageSource {
  public:
    /// Decodes with the threads that call it: OpenImageIO gets none of its own in this process.
    /// `decoder_processes` must outlive the source.
    explicit InProcessSource(ImageSource& decoder_processes);

    /// Images whose decoder_bytes() are more are decoded in decoder processes.
    void limit(size_t bytes) { limit_bytes_ = bytes; }

    Result<std::unique_ptr<SourceImage>> open(const std::string& asset, ImageUse use) override;

  private:
    ImageSource& decoder_processes_;
    FileSource files_;
    std::atomic<size_t> limit_bytes_;
};

}  // namespace velatura::plugins::openimageio
