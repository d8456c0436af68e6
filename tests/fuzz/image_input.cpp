// SPDX-License-Identifier: Apache-2.0
#include "image_input.h"

#include <algorithm>
#include <cstring>
#include <utility>
#include <variant>

namespace velatura::fuzz {

namespace {

class Reader {
  public:
    explicit Reader(std::string_view bytes) : bytes_(bytes) {}

    bool is_at_end() const { return bytes_.empty(); }

    char letter() {
        if (is_at_end()) return 0;
        const char c = bytes_[0];
        bytes_.remove_prefix(1);
        return c;
    }

    std::string text() {
        const size_t end = std::min(bytes_.find('\0'), bytes_.size());
        std::string text(bytes_.substr(0, end));
        bytes_.remove_prefix(std::min(end + 1, bytes_.size()));
        return text;
    }

    template <class T>
    std::vector<T> values(size_t count) {
        std::vector<T> all(count);
        const size_t size = std::min(bytes_.size(), count * sizeof(T));
        std::memcpy(all.data(), bytes_.data(), size);
        bytes_.remove_prefix(size);
        return all;
    }

  private:
    std::string_view bytes_;
};

int side(char c) {
    return 1 + static_cast<unsigned char>(c) % max_pixels;
}

}  // namespace

image::Image image_of(std::string_view bytes) {
    Reader reader(bytes);
    image::Image image;
    image.data.x1 = side(reader.letter());
    image.data.y1 = side(reader.letter());
    image.display = image.data;
    image::Part part;
    const size_t pixels = image.data.pixel_count();
    while (!reader.is_at_end()) {
        const char kind = reader.letter();
        std::string name = reader.text();
        if (kind == 'A') {
            image.attributes[name] = reader.text();
        } else {
            image::Channel channel;
            channel.name = std::move(name);
            if (kind == 'F')
                channel.data = reader.values<float>(pixels);
            else
                channel.data = reader.values<uint32_t>(pixels);
            part.channels.push_back(std::move(channel));
        }
    }
    image.parts.push_back(std::move(part));
    return image;
}

std::string bytes_of(const image::Image& image) {
    std::string bytes = {char(image.data.width() - 1), char(image.data.height() - 1)};
    for (const auto& [name, value] : image.attributes) {
        if (const auto* text = std::get_if<std::string>(&value))
            bytes += 'A' + name + '\0' + *text + '\0';
    }
    for (const image::Part& part : image.parts) {
        for (const image::Channel& c : part.channels) {
            if (c.type() == image::ChannelType::Half) continue;
            bytes += (c.type() == image::ChannelType::Float ? 'F' : 'U') + c.name + '\0';
            bytes.append(static_cast<const char*>(c.bytes()), c.byte_count());
        }
    }
    return bytes;
}

}  // namespace velatura::fuzz
