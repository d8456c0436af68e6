// SPDX-License-Identifier: Apache-2.0
#include "plugins/openimageio/sandbox/messages.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <type_traits>

namespace velatura::plugins::openimageio {

namespace {

// What is sent byte by byte must have no gaps of unknown content
static_assert(std::has_unique_object_representations_v<Request>);
static_assert(std::has_unique_object_representations_v<Reply>);
static_assert(std::has_unique_object_representations_v<LevelSpec>);

constexpr std::array<std::string SourceSpec::*, 5> texts = {
    &SourceSpec::color_space, &SourceSpec::wrap_modes, &SourceSpec::wrap_s, &SourceSpec::wrap_t,
    &SourceSpec::texture_format};
constexpr size_t max_text_bytes = 1000;

Error no_answer(const char* why) {
    return {"reader-answer", why};
}

template <class T>
void append(std::string& bytes, const T& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// Takes values from the front of bytes.
class Taker {
  public:
    explicit Taker(std::string_view bytes) : bytes_(bytes) {}

    template <class T>
    bool take(T& value) {
        if (bytes_.size() < sizeof value) return false;
        std::memcpy(&value, bytes_.data(), sizeof value);
        bytes_.remove_prefix(sizeof value);
        return true;
    }

    bool take(std::string& text) {
        uint32_t size = 0;
        if (!take(size) || size > max_text_bytes || size > bytes_.size()) return false;
        text = bytes_.substr(0, size);
        bytes_.remove_prefix(size);
        return true;
    }

    bool is_at_end() const { return bytes_.empty(); }

  private:
    std::string_view bytes_;
};

bool is_known(StoredAs stored) {
    return stored >= StoredAs::UInt8 && stored <= StoredAs::OtherInteger;
}

/// Bytes of the character that the text begins with; 0 where that is no UTF-8, or a control
/// character. Ref: RFC 3629.
size_t character_length(std::string_view text) {
    const auto byte = [text](size_t i) {
        return i < text.size() ? uint32_t(uint8_t(text[i])) : 0u;
    };
    const uint32_t first = byte(0);
    if (first < 0x80) return first >= 0x20 && first != 0x7f ? 1 : 0;
    const size_t length = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
    if (first < 0xc2 || first > 0xf4) return 0;
    uint32_t code = first & (0x7fu >> length);
    for (size_t i = 1; i < length; ++i) {
        if ((byte(i) & 0xc0) != 0x80) return 0;
        code = code << 6 | (byte(i) & 0x3f);
    }
    const uint32_t min = length == 2 ? 0xa0 : length == 3 ? 0x800 : 0x10000;
    const bool is_surrogate = code >= 0xd800 && code < 0xe000;
    return code >= min && code < 0x110000 && !is_surrogate ? length : 0;
}

}  // namespace

std::string plain_reason(std::string_view text) {
    std::string plain;
    text = text.substr(0, max_reason_bytes);
    while (!text.empty()) {
        const size_t length = character_length(text);
        if (length == 0)
            plain += ' ';
        else
            plain += text.substr(0, length);
        text.remove_prefix(std::max<size_t>(length, 1));
    }
    while (!plain.empty() && plain.back() == ' ') plain.pop_back();
    return plain;
}

Result<size_t> payload_length(const Request& request,
                              const PayloadSize& size,
                              std::string_view reply,
                              std::string_view area) {
    Reply said;
    if (reply.size() != sizeof said) return no_answer("it is of another length");
    std::memcpy(&said, reply.data(), sizeof said);
    if (said.version != protocol_version) return no_answer("it is of another version");
    if (said.serial != request.serial) return no_answer("it answers another request");
    if (said.bytes > area.size()) return no_answer("it is longer than the area");
    if (said.status == ReplyStatus::Refused) {
        if (said.bytes > max_reason_bytes) return no_answer("its reason is too long");
        return Error{"image-read", plain_reason(std::string(area.substr(0, said.bytes)))};
    }
    if (said.status != ReplyStatus::Done) return no_answer("it is neither yes nor no");
    if (said.bytes < size.min || said.bytes > size.max)
        return no_answer("it has another size than requested");
    return size_t(said.bytes);
}

std::string spec_bytes(const SourceSpec& spec) {
    std::string bytes;
    append(bytes, uint32_t(spec.levels.size()));
    for (const LevelSpec& level : spec.levels) append(bytes, level);
    for (const auto text : texts) {
        const std::string_view part = std::string_view(spec.*text).substr(0, max_text_bytes);
        append(bytes, uint32_t(part.size()));
        bytes += part;
    }
    append(bytes, spec.rows_per_strip);
    return bytes;
}

Result<SourceSpec> spec_of(std::string_view bytes) {
    Taker taker(bytes);
    uint32_t count = 0;
    if (!taker.take(count) || count < 1 || count > SourceSpec::max_levels)
        return no_answer("it has no levels, or too many");
    SourceSpec spec;
    spec.levels.resize(count);
    for (LevelSpec& level : spec.levels) {
        if (!taker.take(level) || !is_known(level.stored))
            return no_answer("one of its mip levels is empty");
    }
    for (const auto text : texts) {
        if (!taker.take(spec.*text)) return no_answer("a text is truncated or too long");
    }
    if (!taker.take(spec.rows_per_strip) || !taker.is_at_end())
        return no_answer("it is truncated or too long");
    return spec;
}

}  // namespace velatura::plugins::openimageio
