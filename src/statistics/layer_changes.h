// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/layer_sources.h"
#include "accumulate/sample_sums.h"

#include <cstdint>
#include <string>
#include <vector>

namespace velatura::statistics {

/// How noisy a light layer is, in units of the image: √ of the mean of its variance / (beauty² +
/// 0.01).
struct LayerNoise {
    std::string layer;
    double error = 0;
};

/// How light layers change as samples double, from one pixel of sixteen: that tells their noise as
/// image_change.h tells that of the image. Not for concurrent use.
class LayerChanges {
  public:
    /// The layers by bounce, by light and by lobe that there are.
    explicit LayerChanges(const accumulate::SampleSums& sums);

    /// Before further samples: keeps the means of pixels that have a power of two.
    void keep(const accumulate::SampleSums& sums);

    /// After them: looks at those that have twice as many now.
    void observe(const accumulate::SampleSums& sums);

    /// If errors fall as samples^−slope. Empty before every pixel looked at has doubled once.
    std::vector<LayerNoise> noise(double slope) const;

  private:
    struct Pixel {
        int x, y;
        uint64_t kept = 0;      ///< samples of the means
        bool is_known = false;  ///< `squares` are
    };

    accumulate::Triple mean_of_layer(const accumulate::SampleSums& sums,
                                     const Pixel& pixel,
                                     const accumulate::LayerSource& source,
                                     double weight) const;

    std::vector<accumulate::LayerSource> sources_;
    std::vector<Pixel> pixels_;
    std::vector<float> means_;  ///< [pixel][source][3]
    std::vector<float>
        squares_;  ///< [pixel][source]: of the last change, relative, mean of the channels
};

}  // namespace velatura::statistics
