// SPDX-License-Identifier: Apache-2.0
#include "image/image.h"

#include <algorithm>

namespace velatura::image {

Channel Channel::make(std::string name, ChannelType type, size_t pixel_count) {
    Channel c;
    c.name = std::move(name);
    switch (type) {
        case ChannelType::Half:
            c.data = std::vector<Imath::half>(pixel_count, Imath::half(0.0f));
            break;
        case ChannelType::Float:
            c.data = std::vector<float>(pixel_count, 0.0f);
            break;
        case ChannelType::Uint:
            c.data = std::vector<uint32_t>(pixel_count, 0u);
            break;
    }
    return c;
}

size_t Channel::size() const {
    return std::visit([](const auto& v) { return v.size(); }, data);
}

float Channel::value(size_t pixel) const {
    return std::visit([pixel](const auto& v) { return float(v[pixel]); }, data);
}

const void* Channel::bytes() const {
    return std::visit([](const auto& v) { return static_cast<const void*>(v.data()); }, data);
}

void* Channel::bytes() {
    return std::visit([](auto& v) { return static_cast<void*>(v.data()); }, data);
}

size_t Channel::byte_count() const {
    return std::visit([](const auto& v) { return v.size() * sizeof(v[0]); }, data);
}

const Channel* Part::find(std::string_view channel) const {
    const auto at = std::find_if(channels.begin(), channels.end(),
                                 [channel](const Channel& c) { return c.name == channel; });
    return at == channels.end() ? nullptr : &*at;
}

const Channel* Image::find(std::string_view channel) const {
    for (const Part& part : parts) {
        if (const Channel* c = part.find(channel)) return c;
    }
    return nullptr;
}

std::string Image::text(const std::string& attribute) const {
    const auto at = attributes.find(attribute);
    const auto* text = at == attributes.end() ? nullptr : std::get_if<std::string>(&at->second);
    return text ? *text : std::string();
}

}  // namespace velatura::image
