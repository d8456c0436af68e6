// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "plugins/openimageio/apart/picture_source.h"

namespace velatura::plugins::openimageio {

/// Where this plugin has its pictures from, as long as the process lives. The plugin of a render
/// asks other processes (picture_pool_of_process.cpp); whoever tests decoders links
/// file_source_of_process.cpp instead.
PictureSource& pictures_of_process();

}  // namespace velatura::plugins::openimageio
