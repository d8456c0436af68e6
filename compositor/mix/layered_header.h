// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/mix/layered_image.h"

namespace velatura::compositor::mix {

/// Writes the header of a mix with layers into the attributes of its image: what `verify` checks.
void write_layered_header(LayeredImage& image);

}  // namespace velatura::compositor::mix
