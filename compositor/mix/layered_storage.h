// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/mix/layered_image.h"

#include <array>
#include <string>
#include <vector>

namespace velatura::compositor::mix {

/// Rows and beauty of a file of another renderer that are one gray channel: three channels from the
/// construction on, since gains may give them colors.
class GrayRows {
  public:
    /// Refers to `image`.
    explicit GrayRows(LayeredImage& image);

    /// One channel again for those that are gray still.
    void join();

  private:
    LayeredImage& image_;
    std::vector<std::string> split_;
};

/// Makes halves again of the layers that are halves in the file, where no value changes by it.
void restore_types(LayeredImage& image);

/// For a file of another renderer that has no beauty: adds the one that its rows add up to.
void add_beauty_of_rows(LayeredImage& image, std::array<Values, 3> sum);

}  // namespace velatura::compositor::mix
