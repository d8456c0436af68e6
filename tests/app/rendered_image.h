// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "command.h"
#include "image/exr.h"

#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>

namespace velatura::test {

/// An image of the workplace.
inline image::Image read_image(const Workplace& w, const std::string& file) {
    Result<image::Image> image = image::read_exr(w.path(file));
    if (!image) throw std::runtime_error(image.error().message);
    return std::move(*image);
}

/// Of pixel i.
inline double value(const image::Image& image, const std::string& channel, size_t i) {
    const image::Channel* c = image.find(channel);
    if (!c) throw std::runtime_error("no channel " + channel);
    return double(c->value(i));
}

}  // namespace velatura::test
