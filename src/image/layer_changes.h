// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "image/layer_sources.h"
#include "image/sample_sums.h"

#include <cstdint>
#include <string>
#include <vector>

namespace velatura::image {

/// How noisy a light layer is, in units of the picture: √ of the mean of its variance / (beauty² +
/// 0.01).
struct LayerNoise {
    std::string layer;
    double error = 0;
};

/// How light layers change as samples double, from one pixel of sixteen: that tells their noise as
/// picture_change.h tells that of the picture. Not for concurrent use.
class LayerChanges {
  public:
    /// The layers by bounce, by light and by lobe that there are.
    explicit LayerChanges(const SampleSums& sums);

    /// Before further samples: keeps the means of pixels that have a power of two.
    void keep(const SampleSums& sums);

    /// After them: looks at those that have twice as many now.
    void observe(const SampleSums& sums);

    /// If errors fall as samples^−slope. Empty before every pixel looked at has doubled once.
    std::vector<LayerNoise> noise(double slope) const;

  private:
    struct Pixel {
        int x, y;
        uint64_t kept = 0;      ///< samples of the means
        bool is_known = false;  ///< `squares` are
    };

    Triple mean_of_layer(const SampleSums& sums,
                         const Pixel& pixel,
                         const LayerSource& source,
                         double weight) const;

    std::vector<LayerSource> sources_;
    std::vector<Pixel> pixels_;
    std::vector<float> means_;  ///< [pixel][source][3]
    std::vector<float>
        squares_;  ///< [pixel][source]: of the last change, relative, mean of the channels
};

}  // namespace velatura::image
