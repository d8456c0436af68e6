// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "image/image.h"
#include "layers/layer_header.h"
#include "layers/strip_reader.h"

#include <cstdint>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

namespace velatura::compositor {
inline namespace io {

struct ForeignInputs;

/// What to do with a file that has no header of Velatura: refuse it, or take each `layer.RGB` of it
/// as a row (foreign_layers.h).
enum class ForeignFiles : uint8_t { Reject, Plain };

/// "layer-missing": a layer that the header names as stored, and that the file does not have whole.
Error layer_missing(const std::string& layer);

/// A file of light layers in memory, or only what it holds.
class LayerStack {
  public:
    /// `view`: of a stereo file; empty takes the first.
    /// Errors: "io-open", "io-read", "not-layers", "layers-damaged", "unknown-view".
    static Result<LayerStack> load(const std::string& path,
                                   ForeignFiles foreign = ForeignFiles::Reject,
                                   const std::string& view = "");
    /// Errors: "not-layers", "layers-damaged", "unknown-view".
    static Result<LayerStack> from_image(image::Image image,
                                         ForeignFiles foreign = ForeignFiles::Reject,
                                         const std::string& view = "");
    /// Without pixels: enough for plan_mix and mix_file. Errors as from_image, which name the file.
    static Result<LayerStack> describe(const layers::StripReader& file,
                                       const std::string& path,
                                       ForeignFiles foreign = ForeignFiles::Reject,
                                       const std::string& view = "");
    /// The same of files that were opened together: the beauty of each is a row by the name that
    /// stands for it. Errors: those of describe.
    static Result<LayerStack> describe_together(const layers::StripReader& files,
                                                const std::vector<std::string>& names,
                                                const std::string& view = "");

    /// The same layers of an image that was described without them.
    LayerStack with_pixels(image::Image image) &&;

    const image::Image& image() const { return image_; }

    const layers::LayerHeader& header() const { return header_; }

    /// True for a file without a header of Velatura.
    bool is_plain() const { return is_plain_; }

    /// False for a file of light layers alone, whose beauty is their sum.
    bool has_beauty() const { return place("rgba", 0).has_value(); }

    /// The part that says what the beauty is: its colors, its view.
    size_t beauty_part() const;

    /// Views of a stereo file, none for others, and that of the layers.
    const std::vector<std::string>& views() const { return views_; }

    const std::string& view() const { return view_; }

    /// What a person may want to know of how the file was read.
    const std::vector<std::string>& notes() const { return notes_; }

    /// Channels of a layer of family "data".
    std::vector<layers::ChannelRef> data_channels(const std::string& layer) const;

    /// Of the file; empty where it came from memory.
    const std::string& path() const { return path_; }

    /// R, G or B (c = 0, 1, 2) of a light layer or of `rgba`; c = 3 is the alpha of `rgba`.
    std::optional<layers::ChannelRef> place(const std::string& layer, size_t c) const;
    /// The same; null when it is not stored.
    const image::Channel* channel(const std::string& layer, size_t c) const;

    /// R, G and B of a layer that the header names. Errors: "layer-missing".
    Result<void> check_stored(const std::string& layer) const;

    /// Light groups in the file's order.
    std::vector<std::string> group_names() const;
    /// `b0` … `tail` as far as any stored family tells bounces apart.
    std::vector<std::string> column_names() const;
    /// `emission`, `diffuse` … where the lobe matrix is stored.
    std::vector<std::string> lobe_names() const;

    bool has_family(const std::string& family) const {
        return header_.find_family(family) != nullptr;
    }

  private:
    static Result<LayerStack> from_plain(image::Image image,
                                         const std::string& view,
                                         const ForeignInputs* files);
    void note_skipped(const layers::StripReader& file);

    image::Image image_;
    layers::LayerHeader header_;
    std::unordered_map<std::string, layers::ChannelRef> channels_;           ///< by full name
    std::unordered_map<std::string, std::vector<layers::ChannelRef>> data_;  ///< plain files only
    std::vector<std::string> views_, notes_;
    std::string view_;
    bool is_plain_ = false;
    std::string path_;
};

}  // namespace io
}  // namespace velatura::compositor
