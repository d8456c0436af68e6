// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/sample_sums.h"
#include "base/result.h"
#include "image/compression.h"
#include "image/image.h"
#include "image/window.h"
#include "layers/light_values.h"

#include <array>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace velatura::layers {

enum class Layout : uint8_t { MultiPart, SinglePart, Split };

/// One sample that was left out of the image.
struct BadSample {
    int x = 0, y = 0;
    uint64_t sample = 0;
    std::string reason;
};

/// By MatteKind: names of what there is, whether the image shows it or not; in any order.
using MatteNames = std::array<std::vector<std::string>, accumulate::matte_kinds.size()>;

/// What a file of light layers says beside its pixels. No absolute paths, no times.
struct FileInfo {
    image::Window display;  ///< the whole image; empty = the data window
    Layout layout = Layout::MultiPart;
    image::Compression compression = image::Compression::Zip;
    bool store_sums =
        false;  ///< keep the exact sums, so that `velatura-comp merge` can go on from this file
    uint64_t seed = 0;
    std::string scene_hash;     ///< content of the scene; files of different scenes do not merge
    std::string settings_hash;  ///< whatever else changes pixels, without sample range, threads,
                                ///< tiles and mode
    std::string scene_json = "{}";
    std::string stats_json = "{}";
    std::string plan_json = "{}";
    std::string settings_json = "{}";  ///< the settings by name, to say which of them differ
    std::string software = "velatura";
    double frames_per_second = 24;
    double pixel_aspect_ratio = 1;
    std::array<float, 16> world_to_camera = {1, 0, 0, 0, 0, 1, 0, 0,
                                             0, 0, 1, 0, 0, 0, 0, 1};  ///< rows
    std::array<float, 16> world_to_ndc = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    std::array<float, 8> chromaticities = {0.64f, 0.33f, 0.30f,   0.60f,
                                           0.15f, 0.06f, 0.3127f, 0.3290f};
    std::string color_space = "lin_rec709_scene";  ///< colorInteropID of those chromaticities
    std::vector<BadSample> bad_samples;            ///< goes into velatura/samples
    MatteNames matte_names;                        ///< only used with LayerSet::mattes
    std::vector<LightValues> light_values;         ///< goes into velatura/lights
    /// Of the file that this one is made from: stands in place of software, rate, cameras and
    /// colors above, which are not written then.
    std::optional<image::Attributes> carried;
};

/// What the writer measured.
struct WriteReport {
    std::vector<std::string> files;
    std::string sha256;          ///< of all pixel data
    std::string closure_family;  ///< "lobe-matrix", "matrix", "bounces", "groups" or "none"
    double closure_measured =
        0;  ///< largest |fold − independent beauty| in units of its bound, at most 1
    double closure_absolute = 0;  ///< largest |fold − independent beauty|
    double storage_error =
        0;  ///< √relMSE of the stored beauty against what was summed, by rounding to half or float
    int layers = 0, channels = 0;
    std::vector<std::string> float_layers;  ///< stored float because half would overflow
};

/// Writes the light layers of `sums` as EXR by the contract of docs/reference/layers.md, verifies
/// the temporary, then renames. Errors: "closure-failed", "verify-failed" (exit 4), "io-write"
/// (exit 1), "no-samples", "sums-folded".
Result<WriteReport> write_layer_file(const std::string& path,
                                     const accumulate::SampleSums& sums,
                                     const FileInfo& info);

/// Writes an image as EXR under a temporary name, reads it back, compares, and renames.
/// Errors: "io-write", "verify-failed".
Result<void> write_image_file(const std::string& path,
                              const image::Image& image,
                              image::Compression compression = image::Compression::Zip);

/// What the split layout calls all bookkeeping.
constexpr const char* sums_layer = "sums";

/// The files beside that of a split layout.
struct SplitLayer {
    std::string layer, path;
};

/// Those that the header names; empty for other layouts. Errors: "io-read" (damaged list).
Result<std::vector<SplitLayer>> split_layers(const std::string& path, const image::Image& header);

/// The channels of the files of a split layout, each of which only one file may have.
class SplitChannels {
  public:
    /// Those of the file that lists the others.
    explicit SplitChannels(const image::Image& first) { add(first); }

    /// Errors: "io-read": other than one part, or a channel that another file has.
    Result<void> add(const std::string& path, const image::Image& file);

  private:
    std::string add(const image::Image& file);

    std::set<std::string> names_;
};

/// Reads a file of light layers whole, with the files beside it for the split layout; parts over
/// windows of their own are placed (strip_reader.h).
/// Errors: "io-open", "io-read".
Result<image::Image> read_layer_file(const std::string& path);

}  // namespace velatura::layers
