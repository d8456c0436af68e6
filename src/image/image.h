// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "image/compression.h"
#include "image/window.h"

#include <Imath/half.h>

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace velatura::image {

enum class ChannelType : uint8_t { Half, Float, Uint };

/// One named channel over the data window of its image: [height][width], row 0 = top.
struct Channel {
    std::string name;  ///< full name, `layer.R`
    std::variant<std::vector<Imath::half>, std::vector<float>, std::vector<uint32_t>> data;

    static Channel make(std::string name, ChannelType type, size_t pixel_count);

    ChannelType type() const { return ChannelType(data.index()); }

    size_t size() const;
    /// The value as a float; integers are converted.
    float value(size_t pixel) const;
    const void* bytes() const;
    void* bytes();
    size_t byte_count() const;
};

/// Calls f(pixel, value as float) for every pixel of a channel, in order.
template <class F>
void for_each_value(const Channel& channel, F f) {
    std::visit(
        [&f](const auto& values) {
            for (size_t i = 0; i < values.size(); ++i) f(i, float(values[i]));
        },
        channel.data);
}

using Matrix44 = std::array<float, 16>;       ///< rows; row vectors
using Chromaticities = std::array<float, 8>;  ///< red, green, blue, white: x y

/// An attribute of any other type (time codes, boxes, lists …), as the bytes that the file has.
struct OtherAttribute {
    std::string type;  ///< EXR's name of it: `timecode`, `v3f`, `stringvector` …
    std::string bytes;

    bool operator==(const OtherAttribute&) const = default;
};

using Attribute = std::variant<std::string,
                               int,
                               float,
                               double,
                               std::array<float, 2>,
                               Matrix44,
                               Chromaticities,
                               OtherAttribute>;
using Attributes = std::map<std::string, Attribute>;

/// A group of channels that a file stores together.
struct Part {
    std::string name;
    std::vector<Channel> channels;
    Attributes attributes;  ///< beside those of the image
    bool is_lossy = false;  ///< read from a compression that changes floats; writing ignores it
    /// In place of that of the file, unless the file is to have none.
    std::optional<Compression> compression = std::nullopt;

    const Channel* find(std::string_view channel) const;
};

/// A file of images over one data window.
struct Image {
    Window data;     ///< where pixels are
    Window display;  ///< the whole image
    float pixel_aspect_ratio = 1.0f;
    Attributes
        attributes;  ///< on the first part of the file; chromaticities and matrices on every part
    std::vector<Part> parts;

    /// The first channel of that full name in any part.
    const Channel* find(std::string_view channel) const;
    /// A string attribute, or an empty text.
    std::string text(const std::string& attribute) const;
};

}  // namespace velatura::image
