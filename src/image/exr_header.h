// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "image/image.h"

#include <Imath/ImathBox.h>
#include <OpenEXR/ImfForward.h>

#include <string>

namespace velatura::image {

/// Our windows end behind their last pixel, those of OpenEXR with it.
Imath::Box2i exr_box(const Window& window);
Window window_of(const Imath::Box2i& box);

void insert_attribute(Imf::Header& header, const std::string& name, const Attribute& attribute);

/// Adds the header's attributes, without those that OpenEXR itself manages. Throws where a string
/// of ours is JSON nested too deeply to be read.
void read_attributes(const Imf::Header& header, Attributes& to);

}  // namespace velatura::image
