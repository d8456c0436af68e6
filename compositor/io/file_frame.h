// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "image/image.h"

#include <optional>

namespace velatura::compositor {
inline namespace io {

/// The frame that a file was rendered at, as its header says; none: it does not say, or it is a
/// image of the default time.
std::optional<double> frame_of(const image::Image& image);

}  // namespace io
}  // namespace velatura::compositor
