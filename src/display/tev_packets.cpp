// SPDX-License-Identifier: Apache-2.0
#include "display/tev_packets.h"

#include "base/check.h"

#include <bit>
#include <cstdint>
#include <cstring>

namespace velatura::display {

namespace {

enum class Type : char { CreateImage = 4, UpdateImageV3 = 6 };

static_assert(std::endian::native == std::endian::little, "values are sent as they lie in memory");

class Writer {
  public:
    explicit Writer(Type type) : bytes_(sizeof(uint32_t)) { bytes_.push_back(char(type)); }

    template <class T>
    void put(T value) {
        const size_t at = bytes_.size();
        bytes_.resize(at + sizeof(T));
        std::memcpy(bytes_.data() + at, &value, sizeof(T));
    }

    void put(const std::string& text) {
        // As C strings they end at the first zero
        bytes_.insert(bytes_.end(), text.c_str(), text.c_str() + std::strlen(text.c_str()) + 1);
    }

    void put(const std::vector<float>& values) {
        const size_t at = bytes_.size();
        bytes_.resize(at + values.size() * sizeof(float));
        if (!values.empty())
            std::memcpy(bytes_.data() + at, values.data(), values.size() * sizeof(float));
    }

    Bytes finish() {
        const auto length = uint32_t(bytes_.size());
        std::memcpy(bytes_.data(), &length, sizeof(length));
        return std::move(bytes_);
    }

  private:
    Bytes bytes_;
};

/// Whether the viewer raises its window: not.
constexpr char keeps_focus = 0;

}  // namespace

Bytes create_image(const std::string& name,
                   int width,
                   int height,
                   const std::vector<std::string>& channels) {
    Writer out(Type::CreateImage);
    out.put(keeps_focus);
    out.put(name);
    out.put(int32_t(width));
    out.put(int32_t(height));
    out.put(int32_t(channels.size()));
    for (const std::string& channel : channels) out.put(channel);
    return out.finish();
}

Bytes update_image(const std::string& name,
                   const image::Window& window,
                   const std::vector<std::string>& channels,
                   const std::vector<float>& values) {
    VELATURA_CHECK(values.size() == window.pixel_count() * channels.size(),
                   "there is a value for each channel of each pixel");
    Writer out(Type::UpdateImageV3);
    out.put(keeps_focus);
    out.put(name);
    out.put(int32_t(channels.size()));
    for (const std::string& channel : channels) out.put(channel);
    for (const int number : {window.x0, window.y0, window.width(), window.height()})
        out.put(int32_t(number));
    for (size_t c = 0; c < channels.size(); ++c) out.put(int64_t(c));
    for (size_t c = 0; c < channels.size(); ++c) out.put(int64_t(channels.size()));
    out.put(values);
    return out.finish();
}

}  // namespace velatura::display
