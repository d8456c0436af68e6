// SPDX-License-Identifier: Apache-2.0
#include "compositor/io/row_values.h"

#include <bit>
#include <cstdint>

namespace velatura::compositor {
inline namespace io {

namespace {

constexpr uint32_t half_infinity = 0x7c00u, float_infinity = 0x7f800000u;

/// By shifts and one subtraction, which compilers turn into vector code, where a table of 65536
/// floats would miss the first cache. Exact: half to float loses nothing.
bool load_halves(const uint16_t* halves, size_t count, float* row) {
    constexpr uint32_t smallest_normal = 0x400u, exponent_shift = 112u << 23;
    constexpr uint32_t smallest_normal_float = 113u << 23;  // 2^-14
    uint32_t has_bad = 0;
    for (size_t i = 0; i < count; ++i) {
        const uint32_t bits = halves[i], magnitude = bits & 0x7fffu, sign = (bits & 0x8000u) << 16;
        const uint32_t normal = (magnitude << 13) + exponent_shift;
        // A half below 2^-14 is that many 2^-24: the mantissa beside 2^-14, without it
        const float small = std::bit_cast<float>((magnitude << 13) + smallest_normal_float) -
                            std::bit_cast<float>(smallest_normal_float);
        const uint32_t value =
            magnitude < smallest_normal ? std::bit_cast<uint32_t>(small) : normal;
        const uint32_t is_bad = magnitude >= half_infinity ? ~0u : 0u;
        row[i] = std::bit_cast<float>((value | sign) & ~is_bad);
        has_bad |= is_bad;
    }
    return has_bad != 0;
}

bool load_floats(const float* floats, size_t count, float* row) {
    uint32_t has_bad = 0;
    for (size_t i = 0; i < count; ++i) {
        const auto bits = std::bit_cast<uint32_t>(floats[i]);
        const uint32_t is_bad = (bits & float_infinity) == float_infinity ? ~0u : 0u;
        row[i] = std::bit_cast<float>(bits & ~is_bad);
        has_bad |= is_bad;
    }
    return has_bad != 0;
}

}  // namespace

bool load_row(const layers::StripChannel& channel, size_t first, size_t count, float* row) {
    switch (channel.type) {
        case image::ChannelType::Half:
            return load_halves(static_cast<const uint16_t*>(channel.values) + first, count, row);
        case image::ChannelType::Float:
            return load_floats(static_cast<const float*>(channel.values) + first, count, row);
        case image::ChannelType::Uint:
            break;
    }
    const auto* numbers = static_cast<const uint32_t*>(channel.values) + first;
    for (size_t i = 0; i < count; ++i) row[i] = float(numbers[i]);
    return false;
}

NotFinite find_not_finite(const layers::StripChannel& channel, size_t first, size_t count) {
    NotFinite found;
    for (size_t i = 0; i < count; ++i) {
        bool is_bad = false;
        if (channel.type == image::ChannelType::Half) {
            const uint32_t bits = static_cast<const uint16_t*>(channel.values)[first + i];
            is_bad = (bits & half_infinity) == half_infinity;
        } else if (channel.type == image::ChannelType::Float) {
            const float value = static_cast<const float*>(channel.values)[first + i];
            is_bad = (std::bit_cast<uint32_t>(value) & float_infinity) == float_infinity;
        }
        if (is_bad && found.count++ == 0) found.first = i;
    }
    return found;
}

}  // namespace io
}  // namespace velatura::compositor
