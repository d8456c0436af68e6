// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "film/sample_radiance.h"
#include "layers/deep_file.h"

#include <cstdint>
#include <string>
#include <vector>

namespace velatura::film {

/// How deep samples are gathered.
struct DeepOptions {
    /// Of one surface: camera samples whose depths differ by this part become one deep sample.
    float surface_tolerance = 0.01f;
    /// Volumes are cut where the depth has grown by this part.
    float segment_growth = 0.125f;
    /// Deep samples that a pixel may have; beyond it the two nearest to each other become one.
    int max_samples = 32;
};

/// Where the light of the camera samples of each pixel comes from, by depth. A function of the
/// samples alone, added in the order of their indices: not of tiles, passes or threads. 64 bytes
/// for each deep sample, up to twice that where lists have just grown. Threads: one pixel belongs
/// to one task.
class DeepFilm {
  public:
    DeepFilm(const Window& window, const DeepOptions& options);

    /// Adds the next sample of a pixel. Weights must not be negative.
    void add(int x, int y, const SampleRadiance& sample);

    /// The deep image, whose samples laid over each other from front to back give `rgba`:
    /// [height][width][4], the image of the same camera samples as its file stores it. What it
    /// rounds differently from the sum of the samples goes into their colors.
    layers::DeepImage image(const std::vector<float>& rgba) const;

    const DeepOptions& options() const { return options_; }

    size_t memory_bytes() const;

    /// The same of pixels that show one depth each.
    static size_t expected_bytes(const Window& window) {
        return window.pixel_count() * (sizeof(std::vector<Entry>) + sizeof(double) + sizeof(Entry));
    }

  private:
    /// What some camera samples of a pixel have in common.
    struct Entry {
        uint64_t key = 0;  ///< surface, or segment of volumes
        float near = 0, far = 0;
        SampleRadiance::DepthKind kind = SampleRadiance::DepthKind::None;
        double weight = 0, weighted_depth = 0;
        accumulate::Triple light;

        double depth() const { return weighted_depth / weight; }
    };

    static void join(Entry& entry, const Entry& other);
    Entry* find(std::vector<Entry>& pixel, const Entry& added) const;
    void limit(std::vector<Entry>& pixel) const;
    static void lay(std::vector<Entry> pixel,
                    double weight,
                    const float* rgba,
                    std::vector<layers::DeepSample>& out);

    Window window_;
    DeepOptions options_;
    std::vector<std::vector<Entry>> pixels_;
    std::vector<double> weights_;  ///< of all samples of the pixel
};

/// "shot.deep.exr" of "shot.exr".
std::string deep_path(const std::string& image);

/// Writes the deep image beside the file of its flat one, which was written from the same samples
/// and says what the deep samples must add up to. Errors: as image::ExrReader,
/// image::write_deep_file.
Result<layers::DeepImage> write_deep_image(const DeepFilm& film, const std::string& image);

}  // namespace velatura::film
