// SPDX-License-Identifier: Apache-2.0
#include "film/cryptomatte_decoder.h"

#include <gtest/gtest.h>

#include <cstring>

namespace velatura::test {

namespace {

/// MurmurHash3_x86_32 with seed 0, word by word as its author describes it.
uint32_t hash_of(const std::string& text) {
    const auto scramble = [](uint32_t k) {
        k *= 0xcc9e2d51u;
        k = (k << 15) | (k >> 17);
        return k * 0x1b873593u;
    };
    uint32_t h = 0;
    size_t at = 0;
    for (; at + 4 <= text.size(); at += 4) {
        uint32_t k = 0;
        std::memcpy(&k, text.data() + at, 4);
        h ^= scramble(k);
        h = (h << 13) | (h >> 19);
        h = h * 5 + 0xe6546b64u;
    }
    uint32_t tail = 0;
    std::memcpy(&tail, text.data() + at, text.size() - at);
    if (at < text.size()) h ^= scramble(tail);
    h ^= uint32_t(text.size());
    h ^= h >> 16;
    h *= 0x85ebca6bu;
    h ^= h >> 13;
    h *= 0xc2b2ae35u;
    h ^= h >> 16;
    return h;
}

void add_utf8(std::string& out, uint32_t c) {
    if (c < 0x80) {
        out += char(c);
    } else if (c < 0x800) {
        out += char(0xc0 | c >> 6);
        out += char(0x80 | (c & 63));
    } else if (c < 0x10000) {
        out += char(0xe0 | c >> 12);
        out += char(0x80 | (c >> 6 & 63));
        out += char(0x80 | (c & 63));
    } else {
        out += char(0xf0 | c >> 18);
        out += char(0x80 | (c >> 12 & 63));
        out += char(0x80 | (c >> 6 & 63));
        out += char(0x80 | (c & 63));
    }
}

/// A flat JSON dictionary of texts.
class Dictionary {
  public:
    explicit Dictionary(const std::string& text) : text_(text) {}

    std::map<std::string, std::string> read() {
        std::map<std::string, std::string> out;
        take('{');
        if (skip() == '}') return out;
        do {
            const std::string key = string();
            take(':');
            EXPECT_TRUE(out.emplace(key, string()).second) << "twice: " << key;
        } while (skip() == ',' && ++at_);
        take('}');
        EXPECT_EQ(at_, text_.size());
        return out;
    }

  private:
    char skip() {
        while (at_ < text_.size() && std::strchr(" \t\r\n", text_[at_])) ++at_;
        return at_ < text_.size() ? text_[at_] : '\0';
    }

    void take(char c) {
        EXPECT_EQ(skip(), c) << "at " << at_ << " of " << text_;
        ++at_;
    }

    uint32_t four_digits() {
        const auto c = uint32_t(std::stoul(text_.substr(at_, 4), nullptr, 16));
        at_ += 4;
        return c;
    }

    std::string string() {
        std::string out;
        take('"');
        while (at_ < text_.size() && text_[at_] != '"') {
            if (text_[at_] != '\\') {
                EXPECT_GE(uint8_t(text_[at_]), 0x20) << "a control character that is not escaped";
                out += text_[at_++];
                continue;
            }
            const char c = text_[at_ + 1];
            at_ += 2;
            const char* plain = std::strchr("b\bf\fn\nr\rt\t\"\"\\\\//", c);
            if (c != 'u') {
                EXPECT_NE(plain, nullptr) << c;
                out += plain ? plain[1] : '?';
                continue;
            }
            uint32_t code = four_digits();
            if (code >= 0xd800 && code < 0xdc00) {
                at_ += 2;
                code = 0x10000 + ((code - 0xd800) << 10) + (four_digits() - 0xdc00);
            }
            add_utf8(out, code);
        }
        take('"');
        return out;
    }

    const std::string& text_;
    size_t at_ = 0;
};

const std::vector<float>& floats(const image::Image& image, const std::string& name) {
    static const std::vector<float> none;
    const image::Channel* channel = image.find(name);
    const auto* values = channel ? std::get_if<std::vector<float>>(&channel->data) : nullptr;
    EXPECT_NE(values, nullptr) << name << " is not there as floats";
    return values ? *values : none;
}

}  // namespace

uint32_t CryptomatteDecoder::id_of(const std::string& name) {
    const uint32_t hash = hash_of(name);
    uint32_t exponent = (hash & 0x7f800000u) >> 23;
    if (exponent < 1) exponent = 1;
    if (exponent > 254) exponent = 254;
    return (hash & 0x80000000u) | exponent << 23 | (hash & 0x007fffffu);
}

CryptomatteDecoder::CryptomatteDecoder(const image::Image& image, const std::string& layer) {
    // The header says what there is: find the key by the name
    std::string key;
    for (const auto& [name, attribute] : image.attributes) {
        const auto* text = std::get_if<std::string>(&attribute);
        if (name.starts_with("cryptomatte/") && name.ends_with("/name") && text && *text == layer)
            key = name.substr(0, name.size() - 5);
    }
    EXPECT_FALSE(key.empty()) << layer << " is not in the header";
    EXPECT_EQ(key.size(), std::strlen("cryptomatte/") + 7);
    EXPECT_EQ(image.text(key + "/hash"), "MurmurHash3_32");
    EXPECT_EQ(image.text(key + "/conversion"), "uint32_to_float32");
    const std::string text = image.text(key + "/manifest");
    for (const auto& [name, hex] : Dictionary(text).read()) {
        EXPECT_EQ(hex.size(), 8u);
        manifest[name] = uint32_t(std::stoul(hex, nullptr, 16));
        EXPECT_EQ(manifest[name], id_of(name)) << name;
    }

    pixels.resize(image.data.pixel_count());
    std::vector<float> before(pixels.size(), 2.0f);
    for (int level = 0;; ++level) {
        const std::string number = (level < 10 ? "0" : "") + std::to_string(level);
        if (!image.find(layer + number + ".R")) break;
        for (const auto& [id, coverage] : {std::pair("R", "G"), std::pair("B", "A")}) {
            const auto& ids = floats(image, layer + number + "." + id);
            const auto& weights = floats(image, layer + number + "." + coverage);
            for (size_t i = 0; i < pixels.size(); ++i) {
                uint32_t bits = 0;
                std::memcpy(&bits, &ids[i], 4);
                // Ranks fall, and each thing has one
                EXPECT_LE(std::abs(weights[i]), before[i]) << "level " << level;
                before[i] = std::abs(weights[i]);
                if (bits == 0) {
                    EXPECT_EQ(weights[i], 0.0f);
                } else {
                    EXPECT_TRUE(pixels[i].emplace(bits, weights[i]).second)
                        << "twice in pixel " << i;
                }
            }
        }
    }
}

std::vector<float> CryptomatteDecoder::of_id(uint32_t id) const {
    std::vector<float> out;
    for (const auto& pixel : pixels) {
        const auto at = pixel.find(id);
        out.push_back(at == pixel.end() ? 0.0f : at->second);
    }
    return out;
}

std::vector<float> CryptomatteDecoder::total() const {
    std::vector<float> out;
    for (const auto& pixel : pixels) {
        double sum = 0;
        for (const auto& [id, coverage] : pixel) sum += double(coverage);
        out.push_back(float(sum));
    }
    return out;
}

}  // namespace velatura::test
