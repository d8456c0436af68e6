// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "image/image.h"
#include "image/layer_header.h"

#include <string>
#include <unordered_map>
#include <vector>

namespace velatura::compositor {

/// A file of light layers in memory.
class LayerStack {
  public:
    /// Errors: "io-open", "io-read", "not-layers", "layers-damaged".
    static Result<LayerStack> load(const std::string& path);
    /// Errors: "not-layers", "layers-damaged".
    static Result<LayerStack> from_image(image::Image image);

    const image::Image& image() const { return image_; }

    const image::LayerHeader& header() const { return header_; }

    /// R, G or B (c = 0, 1, 2) of a light layer or of `rgba`; null when it is not stored.
    const image::Channel* channel(const std::string& layer, size_t c) const;

    /// Light groups in the file's order.
    std::vector<std::string> group_names() const;
    /// `b0` … `tail` as far as any stored family tells bounces apart.
    std::vector<std::string> column_names() const;

    bool has_family(const std::string& family) const {
        return header_.find_family(family) != nullptr;
    }

  private:
    image::Image image_;
    image::LayerHeader header_;
    std::unordered_map<std::string, std::pair<size_t, size_t>> channels_;  ///< name → part, channel
};

}  // namespace velatura::compositor
