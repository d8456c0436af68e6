// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/limits.h"
#include "plugins/openimageio/sandbox/picture_source.h"

namespace velatura::plugins::openimageio {

/// Where this plugin has its pictures from, as long as the process lives. The plugin of a render
/// asks other processes (picture_pool_of_process.cpp); whoever tests decoders links
/// file_source_of_process.cpp instead.
PictureSource& pictures_of_process();

/// For processes that are started from here on; whoever decodes in its own process has no limits.
void limit_pictures_of_process(const DecodeLimits& limits);

}  // namespace velatura::plugins::openimageio
