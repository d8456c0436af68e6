// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/limits.h"
#include "plugins/openimageio/sandbox/image_source.h"

namespace velatura::plugins::openimageio {

/// Where this plugin decodes images from here on: in decoder processes or in this one, within these
/// limits. Images that are open already stay where they are. The source lives as long as the
/// process. Thread-safe.
ImageSource& select_image_source(const DecodeLimits& limits);

/// The one that was selected last; decoder processes before that. Thread-safe.
ImageSource& image_source();

}  // namespace velatura::plugins::openimageio
